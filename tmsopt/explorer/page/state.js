// The state: what the page shows now, how it changes, and how it is stored for undo, in a link and in a file.

// start of the bicycle: a lean in degrees, and an impulse in DATA.impulseUnit
const STARTS = {lean: 5, push: 0};
// whether roots are eigenfrequencies of a complex H: [Im ω, Re ω, multiplicity], without conjugates
const OF_H = DATA.carrier !== null;
// names of the largest growth rate, of the roots, of the line between decay and growth, and of the parameters as a whole
const [ABSCISSA, ROOTS, AXIS, NOUN] = OF_H
  ? ["largest Im ω", "eigenfrequencies", "the real axis", "point"]
  : ["abscissa", "roots", "the imaginary axis", "design"];
const LAYERS = {kind: "stability", abscissa: ABSCISSA, ...(OF_H ? {} : {damping: "damping ratio"})};
const state = startingState();
const steps = {past: [], future: [], before: null};
const watchers = [];

/** A new element with properties (or attributes, if it has no such property) and children, which are elements or text. */
function element(tag, given = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(given)) {
    if (name in made) made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

/** The element of the page with an id. */
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

/** Text of a value with its unit. */
function withUnit(value, unit, digits = 5) {
  return unit && Number.isFinite(value) ? `${figure(value, digits)} ${unit}` : figure(value, digits);
}

/**
 * Change the state; nothing else changes it. `wanted` has x (pairs of index and value in SI units), plane, over, layer,
 * lean, push. While something is dragged, `settle` is false; all changes until the next settled one are one step of undo.
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
    writeAddress();
  }
  watchers.forEach((watch) => watch(settle));
}

/** Take one step from one list of steps (past or future), and put the current state on the other list. */
function stepBetween(from, to) {
  // a drag ends here
  change({});
  if (!from.length) return;
  to.push(fragmentOf(state));
  Object.assign(state, stateOf(from.pop()).found);
  writeAddress();
  watchers.forEach((watch) => watch(true));
}

/** Undo the last change. */
function undo() {
  stepBetween(steps.past, steps.future);
}

/** Redo the last change that was undone. */
function redo() {
  stepBetween(steps.future, steps.past);
}

/** The state in which the page opened. */
function startingState() {
  return {x: Float64Array.from(DATA.start), plane: [...DATA.plane], over: DATA.over, layer: "kind", ...STARTS};
}

/** All differences from the starting state, as the fragment of a link. Its numbers are exact. */
function fragmentOf({x, plane, over, layer, ...rest}) {
  const name = (k) => encodeURIComponent(DATA.parameters[k].name);
  const parts = [...x].flatMap((value, k) => (value === DATA.start[k] ? [] : [`${name(k)}=${value}`]));
  if (plane.join() !== DATA.plane.join()) parts.push(`.axes=${plane.map(name)}`);
  if (over !== DATA.over) parts.push(`.over=${name(over)}`);
  if (layer !== "kind") parts.push(`.layer=${layer}`);
  for (const [key, value] of Object.entries(STARTS)) if (rest[key] !== value) parts.push(`.${key}=${rest[key]}`);
  return parts.join("&");
}

/** The state in a fragment (`found`), and the parts of the fragment that could not be read (`ignored`). */
function stateOf(fragment) {
  const [found, ignored] = [startingState(), []];
  for (const part of fragment.split("&").filter(Boolean)) if (!takePart(found, part)) ignored.push(part);
  return {found, ignored};
}

/** Write one part of a fragment to a state; return whether it could be read. */
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

/** Whether the bicycle can start with a value: with a lean below 30°, or with any push. */
function isStart(name, value) {
  return Number.isFinite(value) && (name !== "lean" || Math.abs(value) < 30);
}

/** Decode a part of a link; a part with a faulty code stays unchanged. */
function decode(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

/** The number in a text, which may have a unit or a decimal comma; NaN for any other text. */
function numberOf(text, unit = "") {
  const bare = (unit && text.trim().endsWith(unit) ? text.trim().slice(0, -unit.length) : text).trim();
  const joined = /^\D?\d{1,3}(\s\d{3})+([.,]\d*)?$/.test(bare) ? bare.replace(/\s/g, "") : bare;
  const plain = joined.replaceAll("−", "-").replace(",", ".");
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(plain) ? Number(plain) : NaN;
}

/** Why a parameter cannot have a value, given in SI units; empty if it can. */
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

/** Write the state to the address of the page, if it has one. */
function writeAddress() {
  try {
    history.replaceState(null, "", `#${fragmentOf(state)}`);
  } catch {
    // a frame has no address; `copyLink` says so
  }
}

/** Take the state from the address, as one step of undo; return the parts that were ignored. */
function readAddress() {
  const fragment = location.hash.slice(1);
  if (fragment === fragmentOf(state)) return [];
  const {found, ignored} = stateOf(fragment);
  change({...found, x: [...found.x.entries()]});
  return ignored;
}

/** The design as the text of a problem file, in which every parameter is fixed at its double. */
function problemText() {
  const lines = DATA.parameters.map(({name, unit, one, value, text}, k) => {
    // a problem file accepts no smaller number
    const tiny = Math.abs(state.x[k]) < DATA.smallest;
    const number = String(tiny ? 0 : state.x[k] / one);
    const moved = unit ? JSON.stringify(`${number} ${unit}`) : number;
    return `${name} = ${state.x[k] === value && !tiny ? text : moved}\n`;
  });
  return DATA.toml.before + lines.join("") + DATA.toml.after;
}

/** Save the design as a problem file. */
function save() {
  const words = DATA.title.normalize("NFKD").toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, "");
  const address = URL.createObjectURL(new Blob([problemText()], {type: "application/toml"}));
  element("a", {href: address, download: `${words.slice(0, 60) || DATA.model}.toml`}).click();
  // the download has begun before this time
  setTimeout(() => URL.revokeObjectURL(address), 60000);
}

/** All roots, from roots [re, im >= 0, multiplicity]: each is repeated by its multiplicity, and conjugates are added. */
function allRoots(meetings) {
  const each = ([re, im]) => (im && !OF_H ? [[re, im], [re, -im]] : [[re, im]]);
  const all = meetings.flatMap((root) => Array(root[2]).fill(each(root)).flat());
  return {re: Float64Array.from(all, (root) => root[0]), im: Float64Array.from(all, (root) => root[1])};
}

/** Roots as [re, im >= 0, multiplicity], rightmost first. Roots that differ only by rounding are one root. */
function meetingsAt(a) {
  return meetingsOf(rootsOf(a)).filter(([re]) => Number.isFinite(re)).map(([re, im, times]) => [re, heightOf(im), times]);
}

/** The frequency that belongs to the imaginary part of a root of the polynomial; for a complex H it is Re ω. */
function heightOf(im) {
  return im - (DATA.carrier ?? 0);
}

/** Everything that the pictures show of the state, computed once per change. */
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

/** Abscissa, smallest damping ratio and largest angular frequency of roots. */
function motionOfRoots({re, im}) {
  const ratios = [...re].map((part, k) => (part || im[k] ? -part / Math.hypot(part, im[k]) : 0));
  return [Math.max(...re), Math.min(...ratios), Math.max(...im)];
}
