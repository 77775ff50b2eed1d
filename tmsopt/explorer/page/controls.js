// Sliders, number fields and selects. These and the pictures change the state.

const SLIDER_STEPS = 1000;

/** The meaning of a parameter or quantity, without the names of equations; empty if it has none. */
function meaningOf({meaning}) {
  return meaning === "parameter" ? "" : meaning.replace(/ \(equation \w+\)/, "");
}

/** The name of a parameter, with its meaning if it has one. */
function nameOf(parameter) {
  return [parameter.name, meaningOf(parameter)].filter(Boolean).join(", ");
}

/** Give a sentence to screen readers. */
function say(text) {
  by("said").textContent = text;
}

/**
 * Two texts of a value for its field: a short one for reading, and one for editing, from which the exact value can be
 * read back.
 */
function fieldTexts(value, one) {
  const digits = [9, 15, 16, 17].map((n) => Number((value / one).toPrecision(n)));
  return [String(digits[0]).replaceAll("-", "−"), String(digits.find((number) => number * one === value) ?? value / one)];
}

/** The slider of a parameter. A drag, or a key that is held down, is one step of undo. */
function parameterSlider(k) {
  const {low, high, one, unit} = DATA.parameters[k];
  const slider = element("input", {
    type: "range", min: 0, max: SLIDER_STEPS, step: 1, disabled: !(high > low), "aria-label": nameOf(DATA.parameters[k]),
  });
  let isHeld = false;
  const release = () => {
    isHeld = false;
    change({});
  };
  on(slider, "input", () => {
    const share = Number(slider.value) / SLIDER_STEPS;
    change({x: [[k, share === 1 ? high : low + (high - low) * share]]}, false);
  });
  on(slider, "change", () => isHeld || change({}));
  on(slider, "keydown", (event) => {
    const direction = {ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1}[event.key];
    isHeld ||= !["Tab", "Shift", "Control"].includes(event.key);
    if (!direction) return;
    event.preventDefault();
    const next = state.x[k] + (direction * (high - low)) / (SLIDER_STEPS * (event.shiftKey ? 10 : 1));
    change({x: [[k, Math.min(high, Math.max(low, next))]]}, false);
  });
  on(slider, "keyup", () => isHeld && release());
  on(slider, "blur", () => isHeld && release());
  const draw = (value) => {
    slider.value = Math.round(((value - low) / (high - low)) * SLIDER_STEPS);
    slider.setAttribute("aria-valuetext", withUnit(value / one, unit));
  };
  return {slider, draw};
}

/** The field of a parameter. It accepts every possible value; a message gives the reason why it rejects other texts. */
function parameterField(k, message) {
  const parameter = DATA.parameters[k];
  const {name, one, unit, low} = parameter;
  const field = element("input", {
    type: "text", inputMode: low < 0 ? "text" : "decimal", autocomplete: "off", spellcheck: false,
    "aria-label": `${name}${unit ? ` in ${unit}` : ""}`, "aria-describedby": message.id,
  });
  const refuse = (reason) => {
    message.textContent = reason;
    field.setAttribute("aria-invalid", String(Boolean(reason)));
    if (reason) say(`${name}: ${reason}`);
  };
  const write = () => {
    field.value = fieldTexts(state.x[k], one)[Number(document.activeElement === field)];
  };
  const draw = () => {
    write();
    refuse("");
  };
  for (const moment of ["focus", "blur"]) {
    on(field, moment, () => {
      if (field.getAttribute("aria-invalid") !== "true") write();
      if (moment === "focus") field.select();
    });
  }
  on(field, "change", () => {
    if (fieldTexts(state.x[k], one).includes(field.value.trim())) return refuse("");
    const value = numberOf(field.value, unit) * one;
    const reason = impossible(parameter, value);
    refuse(reason);
    if (!reason) change({x: [[k, value]]});
  });
  on(field, "keydown", (event) => event.key === "Escape" && draw());
  return {field, draw};
}

/** One parameter: symbol, meaning, number, unit, slider between its ends, reset. */
function parameterRow(k) {
  const parameter = DATA.parameters[k];
  const {name, unit, one, low, high} = parameter;
  const message = element("p", {className: "message", id: `message-${k}`});
  const {slider, draw: drawSlider} = parameterSlider(k);
  const {field, draw: drawField} = parameterField(k, message);
  const reset = element("button", {type: "button", className: "reset", title: `reset ${name}`, "aria-label": `reset ${name}`}, "↺");
  on(reset, "click", () => change({x: [[k, DATA.start[k]]]}));
  const end = (value) => span("end", figure(value / one, 3));
  const row = element("div", {className: "row", role: "group", "aria-label": nameOf(parameter)},
    element("span", {className: "symbol", title: nameOf(parameter)}, element("b", {}, name), " ", element("small", {}, meaningOf(parameter))),
    span("number", field, span("unit", unit), reset),
    span("slide", end(low), slider, end(high)), message);
  let shown = NaN;
  const draw = () => {
    const value = state.x[k];
    if (value === shown) return;
    shown = value;
    drawSlider(value);
    drawField();
    reset.disabled = value === DATA.start[k];
    row.classList.toggle("changed", !reset.disabled);
    if (value < low || value > high) message.textContent = "beyond the range of the slider";
  };
  return {row, draw};
}

/** All parameters, the free ones first; returns what draws them. */
function controlsPanel(host) {
  const rows = DATA.parameters.map((parameter, k) => ({...parameterRow(k), free: parameter.free}));
  const [free, fixed] = [rows.filter((r) => r.free), rows.filter((r) => !r.free)];
  const sheet = element("button", {type: "button", id: "sheet", "aria-controls": "sliders"});
  const sliders = element("div", {id: "sliders"}, ...free.map((r) => r.row));
  const show = (open) => {
    sheet.setAttribute("aria-expanded", String(open));
    sheet.textContent = open ? "hide" : "show";
    host.classList.toggle("closed", !open);
  };
  on(sheet, "click", () => show(host.classList.contains("closed")));
  show(!matchMedia("(max-width: 30rem)").matches);
  if (fixed.length) {
    const open = !free.length || matchMedia("(min-width: 60rem)").matches;
    const words = `${free.length ? "fixed in the file" : "all fixed in the file"} (${fixed.length})`;
    sliders.append(element("details", {open}, element("summary", {}, words), ...fixed.map((r) => r.row)));
  }
  host.querySelector("h2").append(" ", sheet);
  host.append(sliders);
  return () => rows.forEach((r) => r.draw());
}

/** A labelled select of keys, their words and titles; `read` gives the key of the state, `write` takes one. */
function choice(words, options, read, write) {
  const select = element("select", {}, ...options.map(([value, text, title = ""]) => element("option", {value, title}, text)));
  on(select, "change", () => write(select.value));
  const draw = () => {
    select.value = read();
  };
  return {label: element("label", {className: "choice"}, `${words} `, select), draw};
}

/** Selects of a panel below its title; returns what draws them. */
function choices(panel, ...given) {
  panel.querySelector("h2").after(element("div", {className: "choices"}, ...given.map((g) => g.label)));
  return () => given.forEach((g) => g.draw());
}

/** Selects of the chart, of the roots and of the growth rates; returns what draws them all. */
function choicePanels() {
  const varied = [...DATA.parameters.entries()].filter(([, p]) => p.high > p.low).map(([k, p]) => [k, p.name, meaningOf(p)]);
  const axis = (words, side) => choice(words, varied, () => state.plane[side], (value) => {
    const plane = [...state.plane];
    if (plane[1 - side] === Number(value)) plane[1 - side] = plane[side];
    plane[side] = Number(value);
    change({plane});
  });
  const over = () => choice("over", varied, () => state.over, (value) => change({over: Number(value)}));
  const drawn = [choices(by("plane"), over()), choices(by("growth"), over())];
  if (state.plane.length === 2) {
    const layer = choice("colours", Object.entries(LAYERS), () => state.layer, (value) => change({layer: value}));
    drawn.push(choices(by("chart"), axis("across", 0), axis("up", 1), layer));
  }
  return () => drawn.forEach((draw) => draw());
}
