// The whole page: buttons, redrawing once per frame, light and dark colours, texts for screen readers.

const THEMES = ["auto", "dark", "light"];
const KEYS = [
  ["Tab, Shift+Tab", "to the next control, or back"],
  ["Arrow keys", "slider: a thousandth of its range, with Shift a tenth of that; chart: move the design, with Shift ten times as far"],
  ["Page Up, Page Down, Home, End", "slider: large steps, ends"],
  ["Ctrl+Z", "undo; Ctrl+Shift+Z or Ctrl+Y: redo"],
  ["Enter, Escape", "number field: take it, leave it"],
];

window.measured = {all: NaN};

/** Make the pictures in their panels, and return functions that draw them. An error is shown in its panel. */
function pictures() {
  const own = by("sheets") ? {sheets: sheetsPicture} : DATA.bicycle && {bicycle: bicyclePicture};
  const makers = {chart: chartPicture, plane: planePicture, growth: growthPicture, ...own, motion: motionPicture};
  return Object.entries(makers).map(([name, make]) => {
    const panel = by(name);
    const host = panel.appendChild(element("div", {className: "body"}));
    const fault = panel.appendChild(element("p", {className: "message", hidden: true}));
    const runGuarded = (task) => {
      try {
        const done = task();
        fault.hidden = true;
        return done;
      } catch (problem) {
        fault.hidden = false;
        fault.textContent = `This picture cannot be drawn: ${problem.message}`;
        console.error(problem);
        return null;
      }
    };
    const made = runGuarded(() => make(host));
    return (drawing) => {
      const before = performance.now();
      if (made) runGuarded(() => made.draw(state, drawing));
      window.measured[name] = performance.now() - before;
    };
  });
}

/** Return a function that draws all panels, once per frame. */
function redrawer(parts) {
  const drawn = pictures();
  const verdict = verdictPanel(by("verdict"));
  let [queued, settled, said] = [false, true, ""];
  const frame = () => {
    queued = false;
    const before = performance.now();
    const drawing = {...drawingOf(), settled};
    const text = verdict(drawing);
    parts.forEach((draw) => draw(drawing));
    drawn.forEach((draw) => draw(drawing));
    window.measured.all = performance.now() - before;
    if (settled && said && text !== said) say(text);
    if (settled) said = text;
  };
  return (isSettled) => {
    settled = isSettled;
    if (!queued) requestAnimationFrame(frame);
    queued = true;
  };
}

/** A button of a bar. */
function button(host, text, title, press) {
  const made = host.appendChild(element("button", {type: "button", title, "aria-label": /\w/.test(text) ? text : title}, text));
  on(made, "click", () => press(made));
  return made;
}

/** Show a short message about what was done; screen readers read it too. */
function note(text) {
  by("note").textContent = text;
}

/** Set light or dark colours, from the system or as chosen. Returns a function that goes to the next choice. */
function theme() {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  let chosen = "auto";
  const apply = (printed = false) => {
    const auto = dark.matches ? "dark" : "light";
    document.documentElement.dataset.theme = printed ? "light" : chosen === "auto" ? auto : chosen;
  };
  on(dark, "change", () => apply());
  on(window, "beforeprint", () => {
    apply(true);
    document.querySelectorAll("details").forEach((details) => (details.open = true));
    // the next frame would be too late
    repaints.forEach((repaint) => repaint());
  });
  on(window, "afterprint", () => apply());
  apply();
  return (made) => {
    chosen = THEMES[(THEMES.indexOf(chosen) + 1) % THEMES.length];
    made.textContent = `theme: ${chosen}`;
    made.setAttribute("aria-label", made.textContent);
    apply();
  };
}

/** Copy the link of the state to the clipboard; if the browser refuses this, show the link in a field. */
async function copyLink() {
  if (location.protocol === "about:") return note("This page has no address here: save the design instead.");
  const address = `${location.href.split("#")[0]}#${fragmentOf(state)}`;
  try {
    await navigator.clipboard.writeText(address);
    note("Link copied.");
  } catch {
    const field = element("input", {type: "text", readOnly: true, value: address, "aria-label": "link"});
    openDialog("link", "Link to copy", field);
    field.select();
  }
}

/** A dialog with a title, content and a button that closes it. */
function openDialog(id, title, ...content) {
  const dialog = by(id);
  const close = element("button", {type: "button"}, "close");
  on(close, "click", () => dialog.close());
  dialog.replaceChildren(element("h2", {id: `${id}-title`}, title), ...content, close);
  dialog.showModal();
}

/** Buttons that go to known designs. Returns a function that marks the design that is shown. */
function designButtons(host) {
  const made = DATA.designs.map((design) => button(host, design.name, `go to ${design.name}`, () =>
    change({x: [...design.values.entries()]})));
  return ({known}) => made.forEach((b, k) => b.setAttribute("aria-pressed", String(DATA.designs[k] === known)));
}

/** Buttons of the page. Returns a function that draws them. */
function pageButtons(host, nextTheme) {
  if (!knownDesign(DATA.start)) button(host, "start", "everything as when the page opened", () => change({...startingState(), x: [...DATA.start.entries()]}));
  const back = button(host, "↶", "undo (Ctrl+Z)", undo);
  const forth = button(host, "↷", "redo (Ctrl+Shift+Z)", redo);
  button(host, "copy link", "a link to this page as it is now", copyLink);
  button(host, "save design", "the design as a problem file for tmsopt solve", save);
  button(host, "theme: auto", "light, dark, or as in the system", nextTheme);
  button(host, "?", "keys", () => openDialog("keys", "Keys", element("dl", {},
    ...KEYS.flatMap(([key, words]) => [element("dt", {}, key), element("dd", {}, words)]))));
  return () => {
    back.disabled = !steps.past.length && steps.before === null;
    forth.disabled = !steps.future.length;
  };
}

/** Undo and redo by keys. While the user edits a field, the keys act on the text of this field. */
function listenToKeys() {
  on(document, "keydown", (event) => {
    const key = event.key.toLowerCase();
    const typing = event.target.matches("input") && event.target.dataset.typed;
    if (!(event.ctrlKey || event.metaKey) || event.altKey || !["z", "y"].includes(key) || typing) return;
    event.preventDefault();
    if (key === "y" || event.shiftKey) redo();
    else undo();
  });
  on(document, "input", ({target}) => (target.dataset.typed = "yes"));
  on(document, "change", ({target}) => delete target.dataset.typed);
}

/** Show the parts of a link that could not be read. */
function reportIgnored(ignored) {
  if (ignored.length) note(`Ignored in the link: ${ignored.map(decode).join(", ")}`);
}

/** Build the page and draw it. */
function start() {
  by("title").textContent = DATA.title || DATA.modelTitle;
  by("about").textContent = DATA.title ? DATA.modelTitle : "";
  if (OF_H) by("plane-title").textContent = "Eigenfrequencies";
  by("footer").textContent = `tmsopt ${DATA.version}`;
  const nextTheme = theme();
  const parts = [
    designButtons(by("designs")), pageButtons(by("tools"), nextTheme), controlsPanel(by("controls")), choicePanels(),
    limitsPanel(by("limits")), quantitiesPanel(by("quantities")), knownPanel(by("known")),
  ];
  const redraw = redrawer(parts);
  watchers.push(redraw);
  listenToKeys();
  on(window, "hashchange", () => reportIgnored(readAddress()));
  const {found, ignored} = stateOf(location.hash.slice(1));
  Object.assign(state, found);
  reportIgnored(ignored);
  redraw(true);
}

start();
