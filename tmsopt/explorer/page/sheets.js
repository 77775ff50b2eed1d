// Riemann sheets: all eigenvalues over the plane of the chart, as surfaces that pointer and arrow keys turn.

// largest numbers of faces of a picture and of points along an axis; every 5th line of the grid is drawn
const [MAX_FACES, MAX_AXIS_POINTS, MESH] = [5000, 31, 5];
// three colours of Matplotlib's map cividis, which `tmsopt sheets` uses too
const [DARK, MIDDLE, LIGHT] = ["#00224e", "#7d7c78", "#fee838"];
const SHADES = Array.from({length: 65}, (_, k) => (k < 32 ? mixed(DARK, MIDDLE, k / 32) : mixed(MIDDLE, LIGHT, k / 32 - 1)));
const PART_LABELS = OF_H ? ["Re ω", "Im ω (loss negative)"] : ["growth rate Re s", "frequency Im s"];
// half the width, depth and height of the box around the sheets
const BOX = [1, 1, 0.75];
const TURNS = {ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, -5], ArrowDown: [0, 5]};
// direction in degrees from which both pictures are seen
const view = {turn: -60, tilt: 30};
let keptSheets = {key: ""};

// the page of a bicycle has no sheets, and the page of another system has no bicycle
const sheetsTitle = element("h2", {id: "sheets-title"}, "Riemann sheets");
const sheetsPanel = element("section", {id: "sheets", className: "panel", "aria-labelledby": sheetsTitle.id}, sheetsTitle);
by("bicycle").replaceWith(...(DATA.plane.length > 1 ? [sheetsPanel] : []));

/** Real and imaginary part of ω for a complex H, otherwise of s. */
function partsOf(growth, frequency) {
  return OF_H ? [frequency, growth] : [growth, frequency];
}

/** All eigenvalues [re, im] over the plane, row by row of `ys`, sorted by real parts and sorted by imaginary parts. */
function sheetsOf({x, plane}) {
  const key = `${plane} ${Array.from(x, (value, k) => (plane.includes(k) ? 0 : value))}`;
  if (key === keptSheets.key) return keptSheets;
  const [at, a] = [Float64Array.from(x), new Float64Array(MODEL.degree + 1)];
  const points = Math.min(MAX_AXIS_POINTS, Math.floor(Math.sqrt((MAX_FACES * (OF_H ? 2 : 1)) / MODEL.degree)));
  const [xs, ys] = plane.map((k) => evenly(rangeOf(k), points));
  const values = Array.from({length: points ** 2}, (_, k) => {
    [at[plane[0]], at[plane[1]]] = [xs[k % points], ys[Math.floor(k / points)]];
    MODEL.coefficients(at, a);
    const {re, im} = rootsOf(a, true);
    // for a complex H, only the polynomial has the conjugates
    return [...re.keys()].filter((n) => !OF_H || im[n] > 0).map((n) => partsOf(re[n], heightOf(im[n])));
  });
  const sizes = Float64Array.from(values.flat().filter((z) => z.every(Number.isFinite)), (z) => Math.hypot(...z)).sort();
  // parts that differ only by rounding are equal; eigenvalues near a pole would hide all others
  const [same, far] = [1e-7 * sizes[sizes.length - 1] || 1, 10 * sizes[sizes.length >> 1]];
  const order = (k) => (u, v) => Math.round(u[k] / same) - Math.round(v[k] / same) || u[1 - k] - v[1 - k];
  const sheets = [0, 1].map((k) => values.map((all) => [...all].sort(order(k))));
  const near = values.flat().filter((z) => Math.hypot(...z) <= far);
  keptSheets = {key, xs, ys, sheets, limits: [0, 1].map((k) => limitsOfAll(near.map((z) => z[k])))};
  return keptSheets;
}

/** The box seen from `view`: pixels of points with coordinates from -1 to 1, and signs of the way to the viewer. */
function boxIn(width, height) {
  const [turn, tilt] = [view.turn, view.tilt].map((angle) => (angle * Math.PI) / 180);
  const [cos, sin, high, flat] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)];
  const scale = 0.5 * Math.min((width - 120) / Math.SQRT2, (height - 78) / (Math.SQRT2 * flat + BOX[2] * high));
  const pixel = (...point) => {
    const [x, y, z] = point.map((value, n) => scale * value * BOX[n]);
    return {x: width / 2 + 12 + y * cos - x * sin, y: height / 2 - 1 + (x * cos + y * sin) * flat - z * high};
  };
  return {pixel, high, flat, near: [cos < 0 ? -1 : 1, sin < 0 ? -1 : 1]};
}

/** Draw the back of the box, with numbers and labels along two edges of its floor and along its left edge. */
function drawBehind(context, {pixel, high: upright, flat, near: [x, y]}, axes, colours) {
  const [left, back, right, floor] = [[y, -x], [-x, -y], [-y, x], pixel(0, 0, -1)];
  const line = (...corners) => drawLine(context, corners.map((corner) => pixel(...corner)), colours.line, 1);
  for (const side of [left, back, right]) line([...side, 1], [...side, -1]);
  line(...[left, back, right].map((side) => [...side, 1]));
  line(...[left, back, right, [x, y], left].map((side) => [...side, -1]));
  const edges = [[[-1, y, -1], [1, y, -1]], [[x, -1, -1], [x, 1, -1]], [[...left, -1], [...left, 1]]];
  edges.forEach(([from, to], n) => {
    const {label, one, ends: [low, high]} = axes[n];
    const at = (value) => pixel(...from.map((start, m) => start + ((value - low) / (high - low)) * (to[m] - start)));
    const [start, centre, end] = [low, (low + high) / 2, high].map(at);
    // outwards if seen from above, and downwards if seen from the side
    const [aside, below] = n < 2 ? [flat * (centre.x - floor.x), centre.y - floor.y + 40 * upright] : [-1, 0];
    const [across, down] = [aside, below].map((side) => side / Math.hypot(aside, below));
    const length = Math.hypot(end.x - start.x, end.y - start.y);
    const write = (text, place, away) => context.fillText(text, place.x + away * across, place.y + away * down);
    const aligned = Math.abs(across) < 0.3 ? "center" : across < 0 ? "right" : "left";
    Object.assign(context, {fillStyle: colours.ink, textAlign: aligned});
    const ticks = length > 25 ? ticksBetween(low / one, high / one, length / (n < 2 ? 32 : 22)) : [];
    for (const tick of ticks) write(figure(tick, 12), at(tick * one), 11);
    if (n < 2) write(label, centre, 36);
    context.textAlign = "center";
    if (n === 2) drawTurned(context, label, Math.max(9, centre.x - 54), centre.y);
  });
}

/** Draw all faces, the far ones first. Where sheets are above each other, the upper one covers the lower one. */
function drawFaces(context, {near}, pixels, shades, ink) {
  const points = Math.sqrt(pixels.length);
  const [columns, rows] = near.map((side) => [...Array(points - 1).keys()].sort((u, v) => side * (u - v)));
  for (const first of rows.flatMap((row) => columns.map((column) => row * points + column))) {
    const corners = [0, 1, points + 1, points].map((k) => pixels[first + k]);
    for (let n = 0; n < corners[0].length; n += 1) {
      const isCovered = corners.every((all) => all[n + 1] && Math.abs(all[n + 1].y - all[n].y) < 0.01);
      if (isCovered || !corners.every((all) => all[n])) continue;
      const [x, y] = ["x", "y"].map((side) => (corners[0][n][side] + corners[2][n][side]) / 2);
      context.beginPath();
      // a little larger than the face, so that there are no gaps between faces
      for (const {[n]: at} of corners) context.lineTo(at.x + Math.sign(at.x - x) / 2, at.y + Math.sign(at.y - y) / 2);
      context.fillStyle = shades[first][n];
      context.fill();
      if (Math.floor(first / points) % MESH === 0) drawLine(context, [corners[0][n], corners[1][n]], ink, 0.5);
      if ((first % points) % MESH === 0) drawLine(context, [corners[0][n], corners[3][n]], ink, 0.5);
    }
  }
}

/** Both pictures of the sheets: the height is the real or the imaginary part, and the colour shows the other part. */
function sheetsPicture(host) {
  let [now, pointer] = [null, null];
  // the pictures without dots, which are drawn again only if the sheets, the view, the size or the colours change
  const images = [0, 1].map(() => ({look: "", image: document.createElement("canvas")}));
  const surfaces = [0, 1].map((k) => canvasIn(host, (width) => clamp(280, 0.75 * width, 440), (...on) => paint(k, ...on)));
  const says = surfaces.map(({canvas}) => makeDescriber(canvas));
  const legend = legendIn(host);
  const words = "Sheets are sorted by height, so they meet along cuts, where the colour jumps.";
  part(host, "p", {class: "reading"}, `Drag a picture or press arrow keys to turn both. ${words}`);

  function paint(k, context, width, height) {
    if (!now) return;
    const [{plane, x}, {key, xs, ys, sheets, limits}, colours] = [now.state, sheetsOf(now.state), currentColours()];
    const [box, labels] = [boxIn(width, height), PART_LABELS.map((label) => withLabelUnit(label, DATA.rootUnit))];
    const axes = plane.map((n) => ({label: parameterLabel(n, width / 4), one: DATA.parameters[n].one, ends: rangeOf(n)}));
    axes.push({label: labels[k], one: 1, ends: limits[k]});
    const share = (value, [low, high]) => (value - low) / (high - low);
    const isInside = (value, n) => value >= axes[n].ends[0] && value <= axes[n].ends[1];
    const pixel = (...at) => at.every(isInside) && box.pixel(...at.map((value, n) => 2 * share(value, axes[n].ends) - 1));
    const [{canvas}, kept] = [context, images[k]];
    const look = [key, view.turn, view.tilt, canvas.width, canvas.height, ...Object.values(colours)].join();
    if (look === kept.look) context.drawImage(kept.image, 0, 0, width, height);
    else {
      const shade = (z) => SHADES[Math.round(64 * clamp(0, share(z[1 - k], limits[1 - k]), 1))];
      const pixels = sheets[k].map((all, at) => all.map((z) => pixel(xs[at % xs.length], ys[Math.floor(at / xs.length)], z[k])));
      drawBehind(context, box, axes, colours);
      drawFaces(context, box, pixels, sheets[k].map((all) => all.map(shade)), colours.ink);
      SHADES.forEach((colour, n) => drawBox(context, width / 2 + 2 * n - 65, 20, 2.5, 10, colour));
      Object.assign(context, {fillStyle: colours.ink, textAlign: "center"});
      context.fillText(`colour: ${labels[1 - k]}`, width / 2, 8);
      limits[1 - k].forEach((end, right) => context.fillText(figure(end, 3), width / 2 + (right ? 95 : -95), 26));
      kept.look = look;
      Object.assign(kept.image, {width: canvas.width, height: canvas.height});
      kept.image.getContext("2d").drawImage(canvas, 0, 0);
    }
    context.textAlign = "center";
    for (const [growth, frequency, times] of now.drawing.meetings) {
      for (const side of OF_H || !frequency ? [1] : [1, -1]) {
        const at = pixel(...plane.map((n) => x[n]), partsOf(growth, side * frequency)[k]);
        if (at) drawDot(context, at.x, at.y, times > 1 ? 7.5 : 5, colours.mark, colours.paper, 2);
        if (at && times > 1) drawText(context, `${times}-fold`, at.x, at.y - 18, colours);
      }
    }
  }

  const turn = (across, down) => {
    Object.assign(view, {turn: (view.turn - across) % 360, tilt: clamp(0, view.tilt + down, 90)});
    surfaces.forEach(({repaint}) => repaint());
  };
  for (const {canvas} of surfaces) {
    acceptKeys(canvas);
    // a finger that moves up or down scrolls the page
    Object.assign(canvas.style, {touchAction: "pan-y", cursor: "grab"});
    on(canvas, "pointerdown", (event) => canvas.setPointerCapture((pointer = event).pointerId));
    on(canvas, "pointermove", (event) => {
      if (event.buttons) turn((event.clientX - pointer.clientX) / 2, (event.clientY - pointer.clientY) / 2);
      pointer = event;
    });
    on(canvas, "keydown", (event) => {
      if (!TURNS[event.key] || event.altKey || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      turn(...TURNS[event.key]);
    });
  }

  return {
    draw(state, drawing) {
      now = {state, drawing};
      turn(0, 0);
      const {mark, paper} = currentColours();
      legend([dotEntry(`${ROOTS} of this ${NOUN}`, mark, paper)]);
      const own = `${ROOTS} of this ${NOUN}: ${rootsInWords(drawing.meetings) || "none"}`;
      const over = state.plane.map(symbolOf).join(" and ");
      says.forEach((say, k) => say(`Riemann sheets: ${PART_LABELS[k]} over ${over}; ${own}. Arrow keys turn the picture.`));
    },
  };
}
