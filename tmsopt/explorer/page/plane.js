// The roots in the complex plane, and their path over one parameter.

/** Limits of the plane that show the current roots. They change only if necessary, so that the picture stands still. */
function planeReach(roots, path, kept) {
  const middle = typicalSize(roots, ([re, im]) => Math.hypot(re, im)) || Infinity;
  const seen = roots.filter(([re, im]) => Math.hypot(re, im) <= 10 * middle);
  const least = 1e-6 * Math.max(1e-300, ...path.map(({re, im}) => Math.hypot(re, im)));
  const own = Math.max(...seen.map(([re, im]) => Math.hypot(re, im)));
  const size = own > least ? own : 1e6 * least; // if all roots are 0, the path determines the size
  const near = path.filter(({re, im}) => Math.hypot(re, im) < 1.6 * size);
  const points = [...seen.map(([re, im]) => ({re, im})), ...near];
  const need = {
    left: Math.min(-0.25 * size, ...points.map(({re}) => re)),
    right: Math.max(0.25 * size, ...points.map(({re}) => re)),
    top: Math.max(0.5 * size, ...points.map(({im}) => Math.abs(im))),
  };
  const width = need.right - need.left;
  const serves =
    kept &&
    kept.left <= need.left &&
    kept.right >= need.right &&
    kept.top >= need.top &&
    Math.max(width, need.top) > 0.45 * Math.max(kept.right - kept.left, kept.top);
  const reach = serves
    ? kept
    : {left: need.left - 0.1 * width, right: need.right + 0.1 * width, top: 1.12 * need.top};
  return {reach, far: roots.filter((root) => !seen.includes(root))};
}

/** Roots in the complex plane. */
function planePicture(host) {
  let now = null;
  let kept = null;
  let far = [];
  const surface = canvasIn(host, (width) => clamp(300, 0.8 * width, 520), paint);
  const reading = part(host, "p", {class: "reading"});
  const legend = legendIn(host);
  const says = makeDescriber(surface.canvas);

  /** Equal scales on both axes, so that angles show damping. For a complex H the mean frequency is at half height. */
  function plotOf(width, height, {left, right, top}, middle) {
    const box = {x0: PLOT_LEFT, y0: 8, width: width - PLOT_LEFT - 12, height: height - 50};
    const scale = Math.max((right - left) / box.width, (2 * top) / box.height);
    const [across, up] = [(scale * box.width - (right - left)) / 2, (scale * box.height) / 2];
    return plotIn(box, [left - across, right + across], [middle - up, middle + up]);
  }

  function paint(context, width, height) {
    if (!now) return;
    const {state, drawing} = now;
    const colours = currentColours();
    const roots = drawing.meetings;
    const sweep = sweepOf(state);
    const value = state.x[state.over];
    const reach = 0.15 * (sweep.ends[1] - sweep.ends[0]);
    const path = sweep.curves.flatMap(({points}) => points.filter(({at}) => Math.abs(at - value) <= reach));
    const all = allRoots(roots).im;
    const middle = OF_H ? all.reduce((sum, im) => sum + im, 0) / all.length : 0;
    ({reach: kept, far} = planeReach(roots.map(([re, im, times]) => [re, im - middle, times]),
      path.map(({re, im}) => ({re, im: im - middle})), kept));
    far = far.map(([re, im, times]) => [re, im + middle, times]);
    const plot = plotOf(width, height, kept, middle);
    const fills = classFills(colours);
    clipped(context, plot, () => {
      drawBox(context, plot.x0, plot.y0, plot.x(0) - plot.x0, plot.height, mixed(fills[3], colours.paper, 0.6));
      drawBox(context, plot.x(0), plot.y0, plot.width, plot.height, mixed(colours.paper, colours.ink, 0.05));
      drawLevel(context, plot, plot.y(0), colours.faint, 1);
      drawUpright(context, plot, plot.x(0), colours.ink, 2.4);
      drawPath(context, plot, sweep, value, colours);
      drawRoots(context, plot, roots, colours);
    });
    context.textAlign = "left";
    drawText(context, "decays", plot.x0 + 8, plot.y0 + 12, colours);
    context.textAlign = "right";
    drawText(context, "grows", plot.x0 + plot.width - 8, plot.y0 + 12, colours);
    drawAxes(
      context,
      plot,
      {label: withLabelUnit(OF_H ? "Im ω (loss negative)" : "growth rate Re s", DATA.rootUnit), one: 1},
      {label: withLabelUnit(OF_H ? "Re ω" : "frequency Im s", DATA.rootUnit), one: 1},
      colours,
    );
    describe(state, roots, colours);
  }

  /** Draw the path: dotted at lower values and solid at higher values; it fades with the distance from the design. */
  function drawPath(context, plot, sweep, value, colours) {
    const span = sweep.ends[1] - sweep.ends[0];
    const shade = (at) => 0.18 + 0.82 * Math.max(0, 1 - Math.abs(at - value) / (0.45 * span));
    for (const side of OF_H ? [1] : [1, -1]) {
      for (const {points} of sweep.curves) {
        const at = ({re, im}) => ({x: plot.x(re), y: plot.y(side * im)});
        let dashOffset = 0;
        points.slice(1).forEach((point, k) => {
          const ends = [at(points[k]), at(point)];
          context.globalAlpha = shade(point.at);
          if (points[k].at >= value) drawLine(context, ends, colours.real, 2.4);
          else drawLine(context, ends, colours.complex, 3.2, DASHES.dots, dashOffset);
          dashOffset += Math.hypot(ends[1].x - ends[0].x, ends[1].y - ends[0].y);
        });
      }
    }
    context.globalAlpha = 1;
  }

  function drawRoots(context, plot, roots, colours) {
    for (const [re, im, times] of roots) {
      for (const side of im > 0 && !OF_H ? [1, -1] : [1]) {
        const [x, y] = [plot.x(re), plot.y(side * im)];
        drawDot(context, x, y, times > 1 ? 7.5 : 5.5, colours.mark, colours.paper, 2);
        if (times === 1) continue;
        drawDot(context, x, y, 11, "", colours.mark, 1.5);
        context.textAlign = "center";
        drawText(context, `${times}-fold`, x, y + (y > plot.y0 + 40 ? -21 : 22), colours);
      }
    }
  }

  function describe(state, roots, colours) {
    const {name} = DATA.parameters[state.over];
    const [low, high] = rangeOf(state.over).map((end) => valueText(state.over, end));
    legend([
      dotEntry(`${ROOTS} of this ${NOUN}`, colours.mark, colours.paper),
      lineEntry(`at lower ${name}, from ${low}`, colours.complex, 3.2, DASHES.dots),
      lineEntry(`at higher ${name}, to ${high}`, colours.real, 2.4, DASHES.whole),
    ]);
    const beyond = rootsInWords(far, 3);
    reading.textContent = roots.length
      ? beyond
        ? `Beyond the picture: ${beyond}`
        : ""
      : `This ${NOUN} has no ${ROOTS}: its leading coefficient is 0 or not a number.`;
    reading.hidden = !reading.textContent;
  }

  return {
    draw(state, drawing) {
      now = {state, drawing};
      surface.repaint();
      const list = rootsInWords(drawing.meetings);
      says(
        `${OF_H ? "Eigenfrequencies" : "Roots"} in the complex plane: ${list || "none"}; their path over ${symbolOf(state.over)} is drawn.`,
      );
    },
  };
}
