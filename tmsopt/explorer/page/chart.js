// The stability chart over two parameters; the other parameters have their current values.

const CHART_POINTS = 200;
// the same grid, with one more design between two neighbours
const FINE_POINTS = 2 * CHART_POINTS - 1;
// longest time of a survey in ms, while something moves and when nothing moves
const [SURVEY_MS, FINE_MS] = [35, 100];
const CURVE_LOOKS = {
  weave: ["whole", 2.4],
  capsize: ["mixed", 2.4],
  infinity: ["dots", 2.4],
  "heavy damping": ["long", 1.3],
  "EP set": ["short", 2.6],
};

/** Equally spaced values of a range, including its ends. */
function evenly([low, high], count) {
  return Float64Array.from({length: count}, (_, k) => low + ((high - low) * k) / (count - 1));
}

/** Whether two designs agree in all parameters, except those with the indices `free`. */
function sameBeside(first, second, free, tolerance) {
  return Array.from(first).every(
    (value, k) =>
      free.includes(k) || Math.abs(value - second[k]) <= tolerance * Math.max(Math.abs(value), Math.abs(second[k])),
  );
}

/**
 * The traced curves over the plane of the chart, with exchanged axes if necessary. Curves that belong to other values of
 * the remaining parameters are left out.
 */
function curvesIn(state) {
  const [i, j] = state.plane;
  return DATA.curves.flatMap((curve) => {
    if (!sameBeside(state.x, DATA.start, [...curve.axes, ...(curve.along || [])], 1e-12)) return [];
    if (curve.axes[0] === i && curve.axes[1] === j) return [curve];
    return curve.axes[0] === j && curve.axes[1] === i ? [{...curve, x: curve.y, y: curve.x}] : [];
  });
}

/** Bands of a layer of numbers. All bands below 0 have one round width, and all bands above 0 another. */
function bandsOf(values, layer) {
  if (layer === "damping") return {down: 0.2, up: 0.2, below: 5, above: 5};
  const known = values.filter(Number.isFinite).sort();
  const low = known.length ? Math.min(0, known[0]) : 0;
  // poles of the abscissa must not use up all colours
  const high = known.length ? Math.max(0, known[Math.floor(0.95 * (known.length - 1))]) : 0;
  const step = (reach) => {
    const [first, second] = ticksBetween(0, reach || 1, 8);
    return second - first || 1;
  };
  const [down, up] = [step(-low), step(high)];
  return {down, up, below: low < 0 ? Math.ceil(-low / down) : 0, above: high > 0 ? Math.ceil(high / up) : 0};
}

/** The colour of each band, from the lowest up. Good values are blue, bad values orange; colours deepen away from 0. */
function bandColours(bands, goodBelow, colours) {
  const side = (count, good) =>
    Array.from({length: count}, (_, k) =>
      mixed(colours.paper, good ? colours.weave : colours.mark, 0.14 + (0.86 * (k + 0.5)) / count),
    );
  return [...side(bands.below, goodBelow).reverse(), ...side(bands.above, !goodBelow)];
}

/** The index of the band of a value. Values beyond all bands belong to the first or the last band. */
function bandAt(value, {down, up, below, above}) {
  const band = below + (value < 0 ? -Math.ceil(-value / down) : Math.floor(value / up));
  return clamp(0, band, below + above - 1);
}

/** The chart as an image with one pixel per design; the first row is at the top. */
function chartImage({found, points: size}, layer, colours) {
  const image = new ImageData(size, size);
  const pixels = new Uint32Array(image.data.buffer);
  const packed = (colour) => {
    const [red, green, blue] = rgbOf(colour);
    // little-endian, as on all machines with browsers
    return (255 << 24) | (blue << 16) | (green << 8) | red;
  };
  const values = layer === "kind" ? null : found[layer];
  const bands = values && bandsOf(values, layer);
  const fills = classFills(colours).map(packed);
  const shades = values && bandColours(bands, layer === "abscissa", colours).map(packed);
  const hatch = packed(mixed(colours.paper, colours.ink, 0.45));
  for (let row = 0; row < size; row += 1) {
    for (let column = 0; column < size; column += 1) {
      const k = (size - 1 - row) * size + column;
      const kind = found.kind[k];
      const known = values ? Number.isFinite(values[k]) : kind > 0;
      if (!known)
        pixels[row * size + column] = Math.floor(((row + column) * CHART_POINTS) / size) % 6 ? fills[0] : hatch;
      else pixels[row * size + column] = values ? shades[bandAt(values[k], bands)] : fills[kind];
    }
  }
  return {image, bands};
}

/** Draw a bar of the bands with the numbers at their edges; 0 is bold. */
function drawBar(context, x, y, width, bands, layer, colours) {
  const shades = bandColours(bands, layer === "abscissa", colours);
  const cell = width / shades.length;
  shades.forEach((shade, k) => {
    drawBox(context, x + k * cell, y, cell + 0.5, 12, shade);
  });
  context.strokeStyle = colours.faint;
  context.lineWidth = 1;
  context.strokeRect(x + 0.5, y + 0.5, width - 1, 11);
  context.textAlign = "center";
  context.fillStyle = colours.ink;
  let free = -Infinity;
  const zero = x + bands.below * cell;
  for (let edge = 0; edge <= shades.length; edge += 1) {
    const value = edge < bands.below ? (edge - bands.below) * bands.down : (edge - bands.below) * bands.up;
    // the first and the last band also have all values beyond the bar
    const beyond = {0: "≤ ", [shades.length]: "≥ "}[edge];
    const text = (value !== 0 && beyond && layer === "abscissa" ? beyond : "") + figure(value, 12);
    const [at, half] = [x + edge * cell, context.measureText(text).width / 2 + 5];
    if (value !== 0 && (at - half < free || Math.abs(at - zero) < half + 8)) continue;
    context.font = value === 0 ? `bold ${PICTURE_FONT}` : PICTURE_FONT;
    context.fillText(text, Math.max(x + half - 12, Math.min(at, x + width - half + 12)), y + 20);
    free = at + half;
  }
  context.font = PICTURE_FONT;
  drawStraight(context, [zero, y - 3], [zero, y + 14], colours.ink, 2);
}

/** The stability chart: fills, exact curves, known designs, and the current design, which pointer and keys move. */
function chartPicture(host) {
  let now = null;
  let surveyed = {key: ""};
  let refining = 0;
  // ms per design
  const pace = {kind: 0, abscissa: 0, damping: 0};
  let plot = null;
  let shaded = {key: ""};
  const raster = document.createElement("canvas");
  if (DATA.parameters.length < 2) {
    part(host, "p", {}, "A chart needs two parameters; this model has one.");
    return {draw() {}};
  }
  const surface = canvasIn(host, (width) => clamp(300, 0.78 * width, 560), paint);
  const reading = part(host, "p", {class: "reading"});
  const legend = legendIn(host);
  const says = makeDescriber(surface.canvas);
  surface.canvas.style.touchAction = "none";

  /** Classes and layers over the plane, on a grid as fine as time allows. They do not depend on the two parameters. */
  function surveyOf(state, fine = false) {
    const [i, j] = state.plane;
    const others = Array.from(state.x, (value, k) => (k === i || k === j ? 0 : value));
    const key = `${state.plane} ${state.layer} ${others}`;
    if (key === surveyed.key && (!fine || surveyed.fine)) return surveyed;
    const sizes = fine ? [FINE_POINTS, CHART_POINTS] : [CHART_POINTS, 140, 100, 70, 50];
    const quick = (count) => pace[state.layer] * count ** 2 < (fine ? FINE_MS : SURVEY_MS);
    const points = sizes.find(quick) || sizes[sizes.length - 1];
    const [xs, ys] = [rangeOf(i), rangeOf(j)].map((ends) => evenly(ends, points));
    const before = performance.now();
    const found = survey(state.x, i, j, xs, ys, state.layer === "kind" ? [] : [state.layer]);
    pace[state.layer] = (performance.now() - before) / points ** 2;
    surveyed = {key, fine, points, found, present: [0, 1, 2, 3, 4].filter((kind) => found.kind.includes(kind))};
    return surveyed;
  }

  function paint(context, width, height) {
    if (!now) return;
    const {state, drawing} = now;
    const [i, j] = state.plane;
    const colours = currentColours();
    const {points, present} = surveyOf(state);
    const look = `${surveyed.key} ${points} ${Object.values(colours)}`;
    if (look !== shaded.key) {
      shaded = {key: look, ...chartImage(surveyed, state.layer, colours)};
      Object.assign(raster, {width: points, height: points});
      raster.getContext("2d").putImageData(shaded.image, 0, 0);
    }
    const {bands} = shaded;
    const head = state.layer === "kind" ? 8 : 50;
    plot = plotIn(
      {x0: PLOT_LEFT, y0: head, width: width - PLOT_LEFT - 12, height: height - head - 42},
      rangeOf(i),
      rangeOf(j),
    );
    exposePlot(surface.canvas, plot);
    clipped(context, plot, () => {
      // a design is at the centre of its pixel, so the first and the last pixel reach half a pixel beyond the ends
      const [dx, dy] = [plot.width / (points - 1), plot.height / (points - 1)];
      context.imageSmoothingEnabled = false;
      context.drawImage(raster, plot.x0 - dx / 2, plot.y0 - dy / 2, plot.width + dx, plot.height + dy);
      drawCurves(context, state, colours);
      drawHairs(context, plot.x(state.x[i]), plot.y(state.x[j]), colours);
    });
    if (bands) {
      context.textAlign = "left";
      context.fillStyle = colours.ink;
      const words =
        state.layer === "abscissa"
          ? `${withLabelUnit(ABSCISSA, DATA.rootUnit)}: below 0 decays`
          : "damping ratio: above 0 decays, 1 swings not at all";
      context.fillText(words, plot.x0, 8);
      drawBar(context, plot.x0, 18, plot.width, bands, state.layer, colours);
    }
    drawAxes(
      context,
      plot,
      {label: parameterLabel(i, plot.width), one: DATA.parameters[i].one},
      {label: parameterLabel(j, plot.height), one: DATA.parameters[j].one},
      colours,
    );
    drawDesigns(context, state, colours);
    drawHere(context, plot.x(state.x[i]), plot.y(state.x[j]), colours);
    legend(entriesOf(state, present, colours));
    readOwn();
  }

  function drawCurves(context, state, colours) {
    for (const curve of curvesIn(state)) {
      const points = Array.from(curve.x, (value, k) => ({x: plot.x(value), y: plot.y(curve.y[k])}));
      const {colour, width, dash} = lookOf(curve, colours);
      // without this white edge for heavy damping, the narrow area between two curves stays visible
      if (curve.set !== "heavy damping") drawLine(context, points, colours.paper, width + 0.8);
      drawLine(context, points, colour, width, dash);
    }
  }

  function drawDesigns(context, state, colours) {
    const [i, j] = state.plane;
    for (const {name, values} of DATA.designs) {
      if (!sameBeside(values, state.x, state.plane, 1e-9)) continue;
      const [x, y] = [plot.x(values[i]), plot.y(values[j])];
      if (!plot.holds(x, y)) continue;
      drawDot(context, x, y, 5, colours.mark, colours.paper);
      const left = x > plot.x0 + 0.75 * plot.width;
      context.textAlign = left ? "right" : "left";
      drawText(context, name, x + (left ? -14 : 14), y + (y > plot.y0 + 24 ? -12 : 14), colours);
    }
  }

  /** Draw cross hairs at the current design. One of them may be visible if the other is not. */
  function drawHairs(context, x, y, colours) {
    context.globalAlpha = 0.55;
    drawUpright(context, plot, x, colours.ink, 1);
    drawLevel(context, plot, y, colours.ink, 1);
    context.globalAlpha = 1;
  }

  /** Draw the current design as a ring. */
  function drawHere(context, x, y, colours) {
    if (!plot.holds(x, y)) return;
    drawDot(context, x, y, 8, "", colours.paper, 5);
    drawDot(context, x, y, 8, "", colours.ink, 2.2);
  }

  /** Colour, width, dash and words of a traced curve. */
  function lookOf({kind, set, along}, colours) {
    const [dash, width] = CURVE_LOOKS[set === "stability" ? kind : set] || CURVE_LOOKS.weave;
    const words = {
      weave: `edge of stability: ${DATA.words.weave}`,
      capsize: `edge of stability: ${DATA.words.capsize}`,
      infinity: "a root at infinity",
    }[kind];
    const following = (along || []).map((k) => symbolOf(k)).join(", ");
    const points = `exceptional points (${kind})${following ? `, where ${following} follows` : ""}`;
    const ofSet = {"heavy damping": ["edge of heavy damping", colours.ink], "EP set": [points, colours.mark]};
    const [text, colour] = ofSet[set] || [
      words || `edge of stability: ${kind}`,
      kind === "weave" ? colours.weave : colours.ink,
    ];
    return {colour, width, dash: DASHES[dash], words: text};
  }

  function entriesOf(state, present, colours) {
    const fills = classFills(colours);
    const classes = state.layer === "kind" ? present : present.filter((kind) => kind === 0);
    const entries = classes.map((kind) =>
      boxEntry(classWords(kind), fills[kind], colours.faint, kind ? "" : mixed(colours.paper, colours.ink, 0.45)),
    );
    const curves = curvesIn(state);
    const inSight = ({x, y}) => x.some((value, k) => plot.holds(plot.x(value), plot.y(y[k])));
    for (const look of curves.filter(inSight).map((curve) => lookOf(curve, colours))) {
      if (!entries.some(({words}) => words === look.words))
        entries.push(lineEntry(look.words, look.colour, look.width, look.dash));
    }
    entries.push(dotEntry(`this ${NOUN}`, "", colours.ink));
    if (DATA.curves.length && !curves.length) {
      const {axes, along = []} = DATA.curves[0];
      const others = sameBeside(now.state.x, DATA.start, [...axes, ...along], 1e-12) ? "axes" : "values";
      entries.push(lineEntry(`exact edges are hidden: other ${others} are set`, colours.paper, 0, DASHES.whole));
    }
    return entries;
  }

  /** Describe a design of the chart in words. */
  function read(state, words, abscissa, at = state.x) {
    const where = state.plane.map((k) => `${symbolOf(k)} = ${valueText(k, at[k])}`).join(", ");
    const number = Number.isFinite(abscissa)
      ? `, ${ABSCISSA} ${figure(abscissa)}${DATA.rootUnit ? ` ${DATA.rootUnit}` : ""}`
      : "";
    const inside = state.plane.every((k) => at[k] >= rangeOf(k)[0] && at[k] <= rangeOf(k)[1]);
    reading.textContent = `${where}: ${words}${number}${inside ? "" : "; outside of this picture"}`;
  }

  function readOwn() {
    const {state, drawing} = now;
    read(state, designWords(drawing.kind, drawing.meetings, drawing.known), drawing.motion[0]);
  }

  const placeAt = (px, py) =>
    now.state.plane.map((k, up) => [k, withinRange(k, up ? plot.valueY(py) : plot.valueX(px))]);
  addDesignMoves(surface.canvas, placeAt, (...steps) =>
    now.state.plane
      .map((k, up) => {
        const [low, high] = rangeOf(k);
        return [k, withinRange(k, now.state.x[k] + (steps[up] * (high - low)) / (CHART_POINTS - 1))];
      })
      .filter((_, up) => steps[up]),
  );
  surface.canvas.addEventListener("pointermove", (event) => {
    if (!plot || event.buttons || !plot.holds(event.offsetX, event.offsetY)) return;
    const at = now.state.x.slice();
    for (const [k, value] of placeAt(event.offsetX, event.offsetY)) at[k] = value;
    const [a, motion] = [new Float64Array(MODEL.degree + 1), new Float64Array(3)];
    MODEL.coefficients(at, a);
    motionOf(a, motion);
    read(now.state, classWords(kindOf(a)), motion[0], at);
  });
  surface.canvas.addEventListener("pointerleave", () => now && readOwn());

  return {
    draw(state, drawing) {
      now = {state, drawing};
      surface.repaint();
      clearTimeout(refining);
      refining = setTimeout(() => {
        surveyOf(state, true);
        surface.repaint();
      }, 150);
      const [first, second] = state.plane.map((k) => `${symbolOf(k)} ${valueText(k, state.x[k], 3)}`);
      const classes = (surveyed.present || []).map((kind) => classWords(kind)).join("; ");
      says(
        `Stability chart: this ${NOUN}, ${first} and ${second}, is ${designWords(drawing.kind, drawing.meetings, drawing.known)}; ` +
          `in the picture are ${classes}. Arrow keys move the ${NOUN}.`,
      );
    },
  };
}
