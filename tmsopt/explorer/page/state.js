// The state: what the page shows now, how it changes, and how it is kept in steps, in a link and in a file.

// degrees, and an impulse in DATA.impulseUnit: what the bicycle starts with
const STARTS = {lean: 5, push: 0};
// whether roots are eigenfrequencies of a complex H: [Im ω, Re ω, multiplicity], without conjugates
const OF_H = DATA.carrier !== null;
// what the greatest growth rate, the roots and the line between decay and growth are called
const [ABSCISSA, ROOTS, AXIS] = OF_H
  ? ["largest Im ω", "eigenfrequencies", "the real axis"]
  : ["abscissa", "roots", "the imaginary axis"];
const LAYERS = {kind: "stability", abscissa: ABSCISSA, ...(OF_H ? {} : {damping: "damping ratio"})};
const state = startingState();
const steps = {past: [], future: [], before: null};
const watchers = [];

/** A new element with properties, or attributes where it has no such property; children are elements or text. */
function element(tag, given = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(given)) {
    if (name in made) made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

/** The element of the page by its id. */
function by(id) {
  return document.getElementById(id);
}

/** A new span of a class. */
function span(className, ...children) {
  return element("span", {className}, ...children);
}

/** Listen to a kind of event. */
function on(target, type, listener) {
  target.addEventListener(type, listener);
}

/** A value and its unit to read. */
function withUnit(value, unit, digits = 5) {
  return unit && Number.isFinite(value) ? `${figure(value, digits)} ${unit}` : figure(value, digits);
}

/**
 * The one way to change the state: x as pairs of index and value in SI, plane, over, layer, lean, push. While something is
 * dragged, settle is false: all until the next settled change is one step of undo.
 */
function change(wanted, settle = true) {
  steps.before ??= fragmentOf(state);
  for (const [index, value] of wanted.x ?? []) state.x[index] = value;
  for (const name of ["plane", "over", "layer", ...Object.keys(STARTS)]) if (name in wanted) state[name] = wanted[name];
  if (settle) {
    if (fragmentOf(state) !== steps.before) {
      steps.past.push(steps.before);
      steps.future = [];
    }
    steps.before = null;
    keepInAddress();
  }
  watchers.forEach((watch) => watch(settle));
}

/** One step: from the steps on one side of now, to those on the other. */
function stepBetween(from, to) {
  // what is being dragged ends here
  change({});
  if (!from.length) return;
  to.push(fragmentOf(state));
  Object.assign(state, stateOf(from.pop()).found);
  keepInAddress();
  watchers.forEach((watch) => watch(true));
}

/** Take back the last change. */
function undo() {
  stepBetween(steps.past, steps.future);
}

/** Do again what was taken back. */
function redo() {
  stepBetween(steps.future, steps.past);
}

/** The state in which the page opened. */
function startingState() {
  return {x: Float64Array.from(DATA.start), plane: [...DATA.plane], over: DATA.over, layer: "kind", ...STARTS};
}

/** All that differs from the start as the fragment of a link; its numbers come back bit for bit. */
function fragmentOf({x, plane, over, layer, ...rest}) {
  const name = (k) => encodeURIComponent(DATA.parameters[k].name);
  const parts = [...x].flatMap((value, k) => (value === DATA.start[k] ? [] : [`${name(k)}=${value}`]));
  if (plane.join() !== DATA.plane.join()) parts.push(`.axes=${plane.map(name)}`);
  if (over !== DATA.over) parts.push(`.over=${name(over)}`);
  if (layer !== "kind") parts.push(`.layer=${layer}`);
  for (const [key, value] of Object.entries(STARTS)) if (rest[key] !== value) parts.push(`.${key}=${rest[key]}`);
  return parts.join("&");
}

/** The state that a fragment writes down, and those of its parts that say nothing here. */
function stateOf(fragment) {
  const [found, ignored] = [startingState(), []];
  for (const part of fragment.split("&").filter(Boolean)) if (!takePart(found, part)) ignored.push(part);
  return {found, ignored};
}

/** One part of a fragment into a state; whether it could be taken. */
function takePart(found, part) {
  const [key, ...rest] = part.split("=");
  const indexOf = (text) => DATA.parameters.findIndex((p) => p.name === decode(text));
  const value = rest.join("=");
  if (key === ".axes") {
    const axes = value.split(",").map(indexOf);
    const fit = !axes.includes(-1) && axes.length === found.plane.length && new Set(axes).size === axes.length;
    if (fit) found.plane = axes;
    return fit;
  }
  if (key === ".layer") {
    if (Object.hasOwn(LAYERS, value)) found.layer = value;
    return Object.hasOwn(LAYERS, value);
  }
  if (Object.hasOwn(STARTS, key.slice(1)) && key[0] === ".") {
    const fit = isStart(key.slice(1), numberOf(value));
    if (fit) found[key.slice(1)] = numberOf(value);
    return fit;
  }
  const index = indexOf(key === ".over" ? value : key);
  if (index < 0) return false;
  if (key === ".over") found.over = index;
  else if (impossible(DATA.parameters[index], numberOf(value))) return false;
  else found.x[index] = numberOf(value);
  return true;
}

/** Whether the bicycle can start with so much: a lean from which it has not fallen yet, any push. */
function isStart(name, value) {
  return Number.isFinite(value) && (name !== "lean" || Math.abs(value) < 30);
}

/** A part of a link in plain letters; itself where it is not well written. */
function decode(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

/** The number that a text writes, perhaps with its unit, NaN for any other text; a comma may stand for the point. */
function numberOf(text, unit = "") {
  const bare = (unit && text.trim().endsWith(unit) ? text.trim().slice(0, -unit.length) : text).trim();
  const joined = /^\D?\d{1,3}(\s\d{3})+([.,]\d*)?$/.test(bare) ? bare.replace(/\s/g, "") : bare;
  const plain = joined.replaceAll("−", "-").replace(",", ".");
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(plain) ? Number(plain) : NaN;
}

/** Why a parameter cannot have a value in SI; empty where it can. */
function impossible(parameter, value) {
  if (!Number.isFinite(value)) return `${withLabelUnit("a number", parameter.unit)} is wanted, such as 1.25 or −3e−4`;
  const [least, most] = [parameter.least ?? -Infinity, parameter.most ?? Infinity];
  const out = parameter.open ? value <= least || value >= most : value < least || value > most;
  if (!out) return "";
  const said = (end, closed, open) => `${parameter.open ? open : closed} ${withUnit(end / parameter.one, parameter.unit)}`;
  const ends = [];
  if (least > -Infinity) ends.push(said(least, "at least", "above"));
  if (most < Infinity) ends.push(said(most, "at most", "below"));
  return `possible: ${ends.join(" and ")}`;
}

/** Keep the state in the address, where the page has one of its own. */
function keepInAddress() {
  try {
    history.replaceState(null, "", `#${fragmentOf(state)}`);
  } catch {
    // a frame without an address: the link says so when it is asked for
  }
}

/** Take over the state of the address, as one step; returns what of it was ignored. */
function visit() {
  const fragment = location.hash.slice(1);
  if (fragment === fragmentOf(state)) return [];
  const {found, ignored} = stateOf(fragment);
  change({...found, x: [...found.x.entries()]});
  return ignored;
}

/** The design as the text of a problem file, every parameter fixed, as exactly as doubles can. */
function problemText() {
  const lines = DATA.parameters.map(({name, unit, one, value, text}, k) => {
    // a file may have no smaller size
    const tiny = Math.abs(state.x[k]) < DATA.smallest;
    const number = String(tiny ? 0 : state.x[k] / one);
    const moved = unit ? JSON.stringify(`${number} ${unit}`) : number;
    return `${name} = ${state.x[k] === value && !tiny ? text : moved}\n`;
  });
  return DATA.toml.before + lines.join("") + DATA.toml.after;
}

/** Hand the design on as a file. */
function save() {
  const words = DATA.title.normalize("NFKD").toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, "");
  const address = URL.createObjectURL(new Blob([problemText()], {type: "application/toml"}));
  element("a", {href: address, download: `${words.slice(0, 60) || DATA.model}.toml`}).click();
  // the download has begun by then
  setTimeout(() => URL.revokeObjectURL(address), 60000);
}

/** Roots given as [re, im >= 0, multiplicity], each as often as it counts, conjugates too where there are any. */
function allRoots(meetings) {
  const each = ([re, im]) => (im && !OF_H ? [[re, im], [re, -im]] : [[re, im]]);
  const all = meetings.flatMap((root) => Array(root[2]).fill(each(root)).flat());
  return {re: Float64Array.from(all, (root) => root[0]), im: Float64Array.from(all, (root) => root[1])};
}

/** Roots as [re, im >= 0, multiplicity], rightmost first: those that rounding alone keeps apart are one. */
function meetingsAt(a) {
  return meetingsOf(rootsOf(a)).filter(([re]) => Number.isFinite(re)).map(([re, im, times]) => [re, heightOf(im), times]);
}

/** What stands for the height of a root of the polynomial: of H Re ω. All else knows of no carrier but by rounding. */
function heightOf(im) {
  return im - (DATA.carrier ?? 0);
}

/** Everything that follows from the state, once per change, for all pictures. */
function drawingOf() {
  const a = new Float64Array(MODEL.degree + 1);
  const motion = new Float64Array(3);
  const y = new Float64Array(DATA.quantities.length + DATA.constraints.length);
  MODEL.coefficients(state.x, a);
  const known = knownDesign(state.x);
  const meetings = known?.roots.length ? known.roots : meetingsAt(a);
  motionOf(a, motion);
  if (meetings.some((root) => root[2] > 1) || known?.roots.length) motion.set(motionOfRoots(allRoots(meetings)));
  MODEL.derived(state.x, motion, y);
  return {a, meetings, motion, kind: kindOf(a), y, known};
}

/** Abscissa, least damping ratio and greatest angular frequency of given roots. */
function motionOfRoots({re, im}) {
  const ratios = [...re].map((part, k) => (part || im[k] ? -part / Math.hypot(part, im[k]) : 0));
  return [Math.max(...re), Math.min(...ratios), Math.max(...im)];
}
