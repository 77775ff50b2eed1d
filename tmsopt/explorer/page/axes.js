// Functions that all pictures use: for sharp canvases, colours, numbers, ticks, axes, legends, pointer and keys.

const COLOUR_NAMES = [
  "stable",
  "heavy",
  "weave",
  "capsize",
  "mark",
  "real",
  "complex",
  "line",
  "paper",
  "ink",
  "faint",
];
const PICTURE_FONT = "12px system-ui, sans-serif";
// width in pixels of the numbers and the label of a vertical axis
const PLOT_LEFT = 68;
const DASHES = {whole: [], long: [9, 4], short: [4, 3], dots: [1.5, 3], mixed: [8, 3, 2, 3]};
// functions that draw each canvas again
const repaints = [];
// verdicts of the package on designs that are neither stable nor unstable
const EDGES = ["marginally stable", "growing", "on the edge of stability"];

const PICTURE_STYLE = `
.picture { min-width: 0; }
.picture canvas { display: block; width: 100%; border-radius: 4px; }
.picture canvas[tabindex] { cursor: crosshair; }
.picture canvas:focus-visible { outline: 3px solid var(--weave); outline-offset: 1px; }
.legend, .moves { display: flex; flex-wrap: wrap; gap: 4px 14px; margin: 4px 0 0; padding: 0; font-size: .8rem; }
.legend li { display: flex; align-items: center; gap: 6px; }
.legend canvas { flex: none; width: 30px; height: 14px; border-radius: 2px; }
.reading { margin: 4px 0 0; min-height: 1.3em; font-size: .8rem; font-variant-numeric: tabular-nums; }
.moves { align-items: center; }
.moves label { display: flex; align-items: center; gap: 6px; }
.moves input { width: 4.2rem; min-height: 2.25rem; padding: 0 .35rem; text-align: right; }
`;

/** Make an element with attributes and text, and append it to a parent. */
function part(parent, tag, attributes = {}, text = "") {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.textContent = text;
  parent.append(made);
  return made;
}

/** The current colours of the page: name → colour. */
function currentColours() {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(
    COLOUR_NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim() || "#808080"]),
  );
}

const colourReader = document.createElement("canvas").getContext("2d");

/** Red, green and blue of a colour in any notation of CSS. */
function rgbOf(colour) {
  colourReader.fillStyle = colour;
  // an opaque colour is always read as #rrggbb
  return [1, 3, 5].map((k) => parseInt(colourReader.fillStyle.slice(k, k + 2), 16));
}

/** A mixture of two colours; `share` is the fraction of the second. */
function mixed(first, second, share) {
  const [from, to] = [rgbOf(first), rgbOf(second)];
  return `rgb(${from.map((value, k) => Math.round(value + share * (to[k] - value))).join(",")})`;
}

/** Fill colours of the classes, from undefined to heavily damped. They also differ in lightness. */
function classFills(colours) {
  const {paper, ink, stable, heavy} = colours;
  return [paper, mixed(paper, ink, 0.38), mixed(paper, ink, 0.1), mixed(paper, stable, 0.62), mixed(paper, heavy, 0.8)];
}

/** Words for a class code. */
function classWords(kind) {
  const {weave, capsize} = DATA.words;
  const how = OF_H ? "gain, beyond" : "unstable by";
  return [
    "undefined",
    `${how} ${capsize}`,
    `${how} ${weave}`,
    "stable",
    "heavily damped (stable, nothing swings)",
  ][kind];
}

/** Distance from the imaginary axis below which roots [re, im, multiplicity] may be on it, because of rounding. */
function roundingOf(roots) {
  return DATA.onAxis * Math.max(0, ...roots.map(([re, im]) => Math.hypot(re, im + (DATA.carrier ?? 0))));
}

/** The largest real part of roots. */
function rightmostOf(roots) {
  return Math.max(...roots.map(([re]) => re));
}

/** Whether the rightmost roots are on the imaginary axis, up to rounding. */
function isMarginal(roots) {
  return Math.abs(rightmostOf(roots)) <= roundingOf(roots);
}

/** Whether a design of a class is on the edge of stability. The signs are exact, except for the rounding of a carrier. */
function isOnEdge(kind, roots, known) {
  if (known?.verdict) return EDGES.includes(known.verdict);
  return kind > 0 && (kind < 3 ? rightmostOf(roots) <= roundingOf(roots) : OF_H && isMarginal(roots));
}

/**
 * The word for a design on the edge of stability. For a known design it is the verdict of the command. Otherwise a
 * multiple root leaves open whether motion grows, because the page does not compute eigenvectors.
 */
function edgeWord(roots, known) {
  const near = rightmostOf(roots) - roundingOf(roots);
  const open = roots.some(([re, , times]) => times > 1 && re >= near);
  return known?.verdict || (open ? "marginal" : "marginally stable");
}

/** Words for a design with these roots: its class, and the boundary on which it lies. */
function designWords(kind, roots, known) {
  if (!OF_H && kind > 2 && roots.every(([, im]) => im === 0) && roots.some((root) => root[2] > 1))
    return "stable, on the edge of heavy damping: nothing swings";
  if (!isOnEdge(kind, roots, known)) return classWords(kind);
  return `${edgeWord(roots, known)}: ${ROOTS} on ${AXIS}, as far as can be computed`;
}

/** A number for readers: with a number of digits, a minus sign, and powers of ten in raised digits. */
function figure(value, digits = 4) {
  if (Number.isNaN(value)) return "none";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const [digitsText, power] = String(Number(value.toPrecision(digits))).split("e");
  const written = digitsText.replace("-", "−");
  return power
    ? `${written}·10${[...power].map((c) => ({"-": "⁻", "+": ""})[c] ?? "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]).join("")}`
    : written;
}

/** The name of a parameter. */
function symbolOf(k) {
  return DATA.parameters[k].name;
}

/** A value, or the nearest end of a range if the value is outside. */
function clamp(low, value, high) {
  return Math.min(high, Math.max(low, value));
}

/** A value of a parameter in its unit, with the unit. */
function valueText(k, value, digits = 4) {
  const {one, unit, low, high} = DATA.parameters[k];
  const shown = Math.abs(value) > DATA.onAxis * (high - low) ? value : 0;
  return figure(shown / one, digits) + (unit ? ` ${unit}` : "");
}

/** Roots [re, im, multiplicity] in words. */
function rootsInWords(roots, digits = 4, rate = 1) {
  const words = ([re, im, times]) =>
    (OF_H
      ? frequencyText(re * rate, im * rate, digits)
      : figure(re * rate, digits) + (im > 0 ? ` ± ${figure(im * rate, digits)}i` : "")) +
    (times > 1 ? ` (${times}-fold)` : "");
  return roots.map(words).join(", ");
}

/** The eigenfrequency of a complex system as text, from its growth rate and its frequency. */
function frequencyText(growth, frequency, digits) {
  const nothing = DATA.onAxis * Math.hypot(growth, frequency, DATA.carrier);
  const [re, im] = [frequency, growth].map((part) => (Math.abs(part) > nothing ? part : 0));
  if (!im) return figure(re, digits);
  const [sign, size] = [im < 0 ? "−" : "+", `${figure(Math.abs(im), digits)}i`];
  return re ? `${figure(re, digits)} ${sign} ${size}` : sign.replace("+", "") + size;
}

/** A label with its unit, if there is one. */
function withLabelUnit(label, unit) {
  return unit ? `${label} in ${unit}` : label;
}

/** A value of a parameter, or the nearest end of its range if the value is outside. */
function withinRange(k, value) {
  const [low, high] = rangeOf(k);
  return clamp(low, value, high);
}

/** Round values between two values; `about` is their approximate number. */
function ticksBetween(low, high, about) {
  const width = (high - low) / Math.max(about, 1);
  if (!(width > 0) || !Number.isFinite(width)) return [];
  const ten = 10 ** Math.floor(Math.log10(width));
  const step = ten * [1, 2, 5, 10].find((k) => k * ten >= width * (1 - 1e-9));
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.floor(high / step + 1e-9) - first;
  return Array.from({length: Math.max(0, count) + 1}, (_, k) => Number(((first + k) * step).toPrecision(12)));
}

/** The label of the axis of a parameter. */
function parameterLabel(k, room) {
  const {name, meaning, unit} = DATA.parameters[k];
  const short = withLabelUnit(name, unit);
  const first = meaning === "parameter" ? "" : String(meaning || "").split(/[,:;]/)[0];
  const long = first ? `${first}, ${short}` : short;
  return 6.6 * long.length < room ? long : short;
}

/** The limits of a parameter's axis; an empty range is widened around the value. */
function rangeOf(k) {
  const {low, high, value} = DATA.parameters[k];
  if (high > low) return [low, high];
  const room = Math.abs(value) / 2 || 1;
  return [value - room, value + room];
}

/** A canvas that is as wide as its host, and sharp on the screen. `paint(context, width, height)` draws its content. */
function canvasIn(host, heightOf, paint) {
  const holder = part(host, "div", {class: "picture"});
  const canvas = part(holder, "canvas", {role: "img"});
  const context = canvas.getContext("2d");
  const repaint = () => {
    const width = holder.clientWidth;
    if (!width) return;
    const height = Math.round(heightOf(width));
    const ratio = window.devicePixelRatio || 1;
    const [across, down] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== across || canvas.height !== down) {
      Object.assign(canvas, {width: across, height: down});
      canvas.style.height = `${height}px`;
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    Object.assign(context, {font: PICTURE_FONT, lineJoin: "round", lineCap: "butt", textBaseline: "middle"});
    paint(context, width, height);
  };
  new ResizeObserver(repaint).observe(holder);
  repaints.push(repaint);
  return {canvas, repaint};
}

/** Draw all canvases again when the page turns dark or light, which does not change the state. */
function watchColours() {
  const style = part(document.head, "style");
  style.textContent = PICTURE_STYLE;
  const again = () => requestAnimationFrame(() => repaints.forEach((repaint) => repaint()));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
  new MutationObserver(again).observe(document.documentElement, {attributes: true});
}
watchColours();

/** Linear scales of a plot inside a box of a canvas: from values to pixels, and from pixels to values. */
function plotIn(box, [left, right], [bottom, top]) {
  const across = box.width / (right - left);
  const up = box.height / (top - bottom);
  return {
    ...box,
    left,
    right,
    bottom,
    top,
    x: (value) => box.x0 + (value - left) * across,
    y: (value) => box.y0 + (top - value) * up,
    valueX: (pixel) => left + (pixel - box.x0) / across,
    valueY: (pixel) => top - (pixel - box.y0) / up,
    holds: (px, py) =>
      px > box.x0 - 1 && px < box.x0 + box.width + 1 && py > box.y0 - 1 && py < box.y0 + box.height + 1,
  };
}

/** Write the position of a plot in its canvas, in pixels, to an attribute, which other programs can read. */
function exposePlot(canvas, {x0, y0, width, height}) {
  canvas.dataset.plot = [x0, y0, width, height].join(" ");
}

/** Draw inside the box of a plot only. */
function clipped(context, plot, draw) {
  context.save();
  context.beginPath();
  context.rect(plot.x0, plot.y0, plot.width, plot.height);
  context.clip();
  draw();
  context.restore();
}

/** Draw frame, ticks, numbers and labels of a plot. `x` and `y` are {label, one}; without a label, x has no numbers. */
function drawAxes(context, plot, x, y, colours) {
  const {x0, y0, width, height} = plot;
  Object.assign(context, {lineWidth: 1, fillStyle: colours.ink, strokeStyle: colours.faint});
  context.textAlign = "center";
  for (const tick of ticksBetween(plot.left / x.one, plot.right / x.one, width / 60)) {
    const at = Math.round(plot.x(tick * x.one)) + 0.5;
    drawStraight(context, [at, y0 + height], [at, y0 + height + 4], colours.faint, 1);
    const text = figure(tick, 12);
    // the last number must stay in the canvas, which has 12 pixels to the right of the plot
    const rightmost = x0 + width + 11 - context.measureText(text).width / 2;
    if (x.label) context.fillText(text, Math.min(at, rightmost), y0 + height + 13);
  }
  context.textAlign = "right";
  const levels = [plot.bottom / y.one, plot.top / y.one].sort((low, high) => low - high);
  for (const tick of ticksBetween(...levels, Math.max(3, height / 45))) {
    const at = Math.round(plot.y(tick * y.one)) + 0.5;
    drawStraight(context, [x0 - 4, at], [x0, at], colours.faint, 1);
    context.fillText(figure(tick, 12), x0 - 7, at);
  }
  context.strokeRect(Math.round(x0) + 0.5, Math.round(y0) + 0.5, Math.round(width) - 1, Math.round(height) - 1);
  context.textAlign = "center";
  context.fillText(x.label, x0 + width / 2, y0 + height + 30);
  drawTurned(context, y.label, 9, y0 + height / 2);
}

/** The label of a vertical axis. */
function drawTurned(context, label, x, y) {
  context.save();
  context.translate(x, y);
  context.rotate(-Math.PI / 2);
  context.fillText(label, 0, 0);
  context.restore();
}

/** Draw a line through points {x, y} in pixels, with a colour, width and dash. */
function drawLine(context, points, colour, width = 1.5, dash = DASHES.whole, offset = 0) {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.setLineDash(dash);
  context.lineDashOffset = offset;
  context.beginPath();
  for (const {x, y} of points) context.lineTo(x, y); // the first point begins the path
  context.stroke();
  context.setLineDash(DASHES.whole);
}

/** A straight line between two points in pixels. */
function drawStraight(context, [x, y], [toX, toY], ...look) {
  drawLine(context, [{x, y}, {x: toX, y: toY}], ...look);
}

/** An upright line across a plot at a pixel. */
function drawUpright(context, plot, x, ...look) {
  drawStraight(context, [x, plot.y0], [x, plot.y0 + plot.height], ...look);
}

/** A level line across a plot at a pixel. */
function drawLevel(context, plot, y, ...look) {
  drawStraight(context, [plot.x0, y], [plot.x0 + plot.width, y], ...look);
}

/** A circle, filled and outlined. */
function drawDot(context, x, y, radius, fill, outline, width = 1.5) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  if (fill) {
    context.fillStyle = fill;
    context.fill();
  }
  if (outline) {
    context.strokeStyle = outline;
    context.lineWidth = width;
    context.stroke();
  }
}

/** Text that stands out from what is below it. */
function drawText(context, text, x, y, colours, colour = colours.ink) {
  context.strokeStyle = colours.paper;
  context.lineWidth = 3.5;
  context.strokeText(text, x, y);
  context.fillStyle = colour;
  context.fillText(text, x, y);
}

/** Fill a canvas rectangle with a colour. */
function drawBox(context, x, y, width, height, colour) {
  context.fillStyle = colour;
  context.fillRect(x, y, width, height);
}

/** Fill a canvas rectangle with slanted lines, which mark undefined designs. */
function drawHatch(context, x, y, width, height, colour, apart = 6) {
  clipped(context, {x0: x, y0: y, width, height}, () => {
    for (let at = x - height; at < x + width; at += apart)
      drawStraight(context, [at, y + height], [at + height, y], colour, 1);
  });
}

/** A legend: a list of signs and words, which is built again only if the words or colours change. */
function legendIn(host) {
  const list = part(host, "ul", {class: "legend"});
  let shown = "";
  return (entries) => {
    const ratio = window.devicePixelRatio || 1;
    const now = JSON.stringify([entries.map(({words, look}) => [words, look]), ratio]);
    if (now === shown) return;
    shown = now;
    list.replaceChildren();
    for (const {words, sign} of entries) {
      const item = part(list, "li");
      const swatch = part(item, "canvas", {"aria-hidden": "true"});
      Object.assign(swatch, {width: 30 * ratio, height: 14 * ratio});
      const context = swatch.getContext("2d");
      context.scale(ratio, ratio);
      sign(context);
      part(item, "span", {}, words);
    }
  };
}

/** An entry of a legend: a filled box, hatched if a hatch colour is given. */
function boxEntry(words, colour, outline, hatch = "") {
  const sign = (context) => {
    drawBox(context, 0, 0, 30, 14, colour);
    if (hatch) drawHatch(context, 0, 0, 30, 14, hatch, 5);
    context.strokeStyle = outline;
    context.strokeRect(0.5, 0.5, 29, 13);
  };
  return {words, look: [colour, outline, hatch], sign};
}

/** An entry of a legend: a line. */
function lineEntry(words, colour, width, dash) {
  const sign = (context) => drawStraight(context, [0, 7], [30, 7], colour, width, dash);
  return {words, look: [colour, width, dash], sign};
}

/** An entry of a legend: a dot. */
function dotEntry(words, fill, outline) {
  return {words, look: [fill, outline], sign: (context) => drawDot(context, 15, 7, 4.5, fill, outline)};
}

/** Describe a canvas to screen readers. The text is set after a pause, so that not every change is read aloud. */
function makeDescriber(canvas) {
  let waiting = 0;
  return (text) => {
    clearTimeout(waiting);
    waiting = setTimeout(() => canvas.setAttribute("aria-label", text), 400);
    if (!canvas.hasAttribute("aria-label")) canvas.setAttribute("aria-label", text);
  };
}

/** Let a picture receive keys; a screen reader does not pass them to plain images. */
function acceptKeys(canvas) {
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "application");
  canvas.setAttribute("aria-roledescription", "picture with arrow keys");
}

/** Let the pointer and the arrow keys move the design. `at(x, y)` and `step(dx, dy)` return [[index, value] ..]. */
function addDesignMoves(canvas, at, step) {
  const changesAt = (event) => {
    const box = canvas.getBoundingClientRect();
    return at(event.clientX - box.left, event.clientY - box.top);
  };
  let isHeld = false;
  let before = [];
  let movedByKey = null;
  acceptKeys(canvas);
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    isHeld = true;
    before = changesAt(event).map(([k]) => [k, state.x[k]]);
    canvas.setPointerCapture(event.pointerId);
    change({x: changesAt(event)}, false);
  });
  canvas.addEventListener("pointermove", (event) => isHeld && change({x: changesAt(event)}, false));
  canvas.addEventListener("pointerup", (event) => {
    if (isHeld) change({x: changesAt(event)});
    isHeld = false;
  });
  canvas.addEventListener("pointercancel", () => {
    // the user scrolls the page with this finger
    if (isHeld) change({x: before});
    isHeld = false;
  });
  const arrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
  canvas.addEventListener("keydown", (event) => {
    const arrow = arrows[event.key];
    const moved =
      arrow &&
      !event.altKey &&
      !event.ctrlKey &&
      !event.metaKey &&
      step(...arrow.map((k) => k * (event.shiftKey ? 10 : 1)));
    if (!moved) return;
    movedByKey = moved;
    event.preventDefault();
    change({x: moved}, false);
  });
  const settle = () => {
    if (movedByKey) change({x: movedByKey});
    movedByKey = null;
  };
  canvas.addEventListener("keyup", settle);
  canvas.addEventListener("blur", settle);
}

/** The lower median of the sizes of roots, each counted with its multiplicity. A few large roots do not change it. */
function typicalSize(roots, sizeOf) {
  const sizes = roots.flatMap((root) => Array(root[2] * (root[1] > 0 ? 2 : 1)).fill(sizeOf(root)));
  return sizes.sort((first, second) => first - second)[Math.floor((sizes.length - 1) / 2)] || 0;
}

/** The known design with exactly these parameters, or undefined. */
function knownDesign(x) {
  return DATA.designs.find(({values}) => values.every((value, k) => value === x[k]));
}
