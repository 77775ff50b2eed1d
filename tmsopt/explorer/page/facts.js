// Facts about the design that the page shows: verdict, limits, numbers, and the results known before.

const CLASS_WORDS = OF_H
  ? ["undefined", "gain", "gain", "stable", "stable"]
  : ["undefined", DATA.words.capsize, DATA.words.weave, "stable", "heavily damped"];

// unit of the roots → unit of time
const TIMES = {"√(g/w)": "√(w/g)", "1/s": "s"};
const MARKS = {undefined: "?", marginal: "≈", "marginally stable": "≈", growing: "✗", unstable: "✗"};

/** `near`: distance from the axis that rounding hides; `times`: largest multiplicity of the roots that decay slowest. */
function slowestOf({motion, meetings}) {
  const near = roundingOf(meetings);
  return {near, times: Math.max(1, ...meetings.filter(([re]) => re >= motion[0] - near).map((root) => root[2]))};
}

/** The verdict in a word and in a sentence, with powers as ^3 and ^(−2 t). */
function verdictOf(drawing) {
  const {kind, motion, meetings, known} = drawing;
  const [abscissa] = motion;
  const {near, times} = slowestOf(drawing);
  const power = times > 1 ? `t${times > 2 ? `^${times - 1}` : ""}` : "";
  if (!kind) return ["undefined", "No verdict: of the characteristic polynomial a coefficient is no number, or the first is 0"];
  if (isOnEdge(kind, meetings, known)) {
    const grows = known?.growth ?? (known?.verdict ? "" : power);
    const fate = grows
      ? `${known?.growth ? "grows" : "can grow"} as ${grows}: ${ROOTS} meet`
      : `neither grows nor dies out: the ${OF_H ? "least damped" : "rightmost"} ${ROOTS} are`;
    return [edgeWord(meetings, known), `A disturbance ${fate} on ${AXIS}, as far as can be computed`];
  }
  const rate = MODEL.rate(state.x);
  const unit = Number.isFinite(rate) ? "s" : TIMES[DATA.rootUnit];
  const term = `${power} e^(${figure(abscissa * (rate || 1))} t)${unit ? `, t in ${unit}` : ""}`.trim();
  if (kind < 3) {
    const both = kind === 1 && meetings.some(([re, im]) => im && re > near);
    const words = both ? CLASS_WORDS.slice(1, 3).join(" and ") : CLASS_WORDS[kind];
    return ["unstable", `${words[0].toUpperCase()}${words.slice(1)}: a disturbance grows as ${term}`];
  }
  const edge = !OF_H && meetings.every(([, im]) => !im) && hasMeeting(meetings);
  if (abscissa >= -near) return [CLASS_WORDS[kind], "Every disturbance dies out, more slowly than can be computed"];
  const still = edge ? " and nothing swings, on the edge of heavy damping" : kind === 4 ? " and nothing swings" : "";
  return [edge ? "stable" : CLASS_WORDS[kind], `Every disturbance dies out${still}, slowest as ${term}`];
}

/** Sentences about the wheels of a bicycle that no load holds on the ground. */
function liftSentences(y) {
  return ["front", "rear"].flatMap((wheel) => {
    const load = y[DATA.quantities.findIndex(({name}) => DATA.bicycle && name === `load_${wheel}`)];
    return load < 0 ? [`the ${wheel} wheel would lift (load ${figure(100 * load, 2)} %)`] : [];
  });
}

/** Text about the known design that is shown, or about one that is so close that only its roots differ. */
function describeNearest(known) {
  if (known) return `${known.name}: ${known.structure}`;
  const near = DATA.designs.find(({values}) => sameBeside(state.x, values, [], 1e-5));
  return near ? `close to ${near.name}${hasMeeting(near.roots) ? `, whose ${ROOTS} are sensitive` : ""}: its button goes there` : "";
}

/** Whether some roots meet. */
function hasMeeting(roots) {
  return roots.some((root) => root[2] > 1);
}

/** Whether all limits hold, in words; empty if there are no limits. */
function limitsInWords({kind, y}) {
  const broken = DATA.constraints.filter((constraint, k) => !limitHolds(constraint, marginOf(y, k)));
  if (!DATA.constraints.length || !kind) return "";
  const held = `all limits ${DATA.others.length ? "shown " : ""}hold${DATA.nominal ? " in the nominal case" : ""}`;
  return broken.length ? `violated: ${broken.map((c) => c.name).join(", ")}` : held;
}

/** Margin of a limit in SI units, which is at least 0 if the limit holds; for an equality, the difference. */
function marginOf(y, k) {
  return y[DATA.quantities.length + k];
}

/** Whether a limit holds within its tolerance. */
function limitHolds({equality, tolerance}, margin) {
  return equality ? Math.abs(margin) <= tolerance : margin >= -tolerance;
}

/** Convert powers in a text, such as ^3 and ^(−2 t), to raised text. */
function typeset(text) {
  return text.split(/\^(\d+|\(.+?\))/).map((piece, k) => (k % 2 ? element("sup", {}, piece.replace(/[()]/g, "")) : piece));
}

/** The verdict: class, sentence, abscissa, known design. Returns a function that draws it and returns its text. */
function verdictPanel(host) {
  const badge = element("strong", {className: "badge"});
  const sentence = span("sentence");
  const lifts = span("lifts");
  const more = span("more");
  const facts = span("more facts");
  host.append(badge, " ", sentence, " ", lifts, " ", more, facts);
  return (drawing) => {
    const {motion, known, y} = drawing;
    const [word, words] = verdictOf(drawing);
    const abscissa = `${ABSCISSA} ${withUnit(motion[0], DATA.rootUnit)}`;
    badge.dataset.is = MARKS[word] ?? "✓";
    badge.textContent = `${badge.dataset.is} ${word}`;
    sentence.replaceChildren(...typeset(words));
    lifts.textContent = liftSentences(y).map((text) => `· ${text}`).join(" ");
    more.textContent = [abscissa, describeNearest(known), limitsInWords(drawing)].filter(Boolean).join(" · ");
    facts.textContent = known?.proved ? ` · ${factText(known.proved, true)}` : "";
    return `${word}: ${words}; ${[...liftSentences(y), more.textContent].join("; ")}`;
  };
}

/** Limits with their sign and margin. Returns a function that draws them. */
function limitsPanel(host) {
  host.hidden = !DATA.constraints.length && !DATA.others.length;
  const rows = DATA.constraints.map((constraint) => {
    const words = span("margin");
    const sign = element("span", {className: "sign", "aria-hidden": "true"});
    const row = element("li", {}, sign, element("span", {}, element("b", {}, constraint.name), " ", element("code", {}, constraint.text)), words);
    return {constraint, row, sign, words};
  });
  host.append(element("ul", {className: "limits"}, ...rows.map((r) => r.row)));
  if (DATA.others.length) host.append(element("p", {}, `Not computed on this page: ${DATA.others.join(", ")}.`));
  if (DATA.nominal) host.append(element("p", {}, "This page shows the nominal case only, without bands and tolerances."));
  return ({y}) => rows.forEach(({constraint, row, sign, words}, k) => {
    const margin = marginOf(y, k);
    const holds = limitHolds(constraint, margin);
    row.className = holds ? "holds" : "broken";
    sign.textContent = holds ? "✓" : "✗";
    words.textContent = marginInWords(constraint, margin, holds);
  });
}

/** A margin in words; the margin of a share is in percent. */
function marginInWords({text, equality, tolerance, unit, one}, margin, holds) {
  const share = DATA.quantities.some((q) => q.share && text.split(/[<>=]+/).some((side) => side.trim() === q.name));
  const size = share ? `${figure(100 * Math.abs(margin))} %` : withUnit(Math.abs(margin) / one, unit);
  if (Number.isNaN(margin)) return "not defined here";
  if (Math.abs(margin) <= tolerance) return equality ? "holds" : "holds, and binds";
  const word = equality ? "off" : holds ? "holds" : "violated";
  return Number.isFinite(margin) ? `${word} by ${size}` : word;
}

/** A remark about a decay rate or decay time, if one is needed. */
function remarkOf(name, value, drawing) {
  const {times} = slowestOf(drawing);
  if (name === "decay_rate" && value <= 0) return "it does not die out";
  return name === "decay_time" && value < Infinity && times > 1 ? `first it grows: ${OF_H ? "an eigenfrequency of the least loss" : "the rightmost root"} is ${times}-fold` : "";
}

/** A text for each root; conjugate and equal roots share one text. */
function rootTexts({meetings}) {
  return meetings.map(([re, im, times]) => rootText(re, im) + (times > 1 ? ` (${times}-fold)` : ""));
}

/** Text of a real root or of a conjugate pair; for a complex system, of an eigenfrequency. */
function rootText(re, im) {
  if (Number.isNaN(re)) return "none";
  if (OF_H) return frequencyText(re, im, 5);
  return im ? `${figure(re, 5)} ± ${figure(Math.abs(im), 5)}i` : figure(re, 5);
}

/** Roots and quantities. Returns a function that draws them. */
function quantitiesPanel(host) {
  const roots = element("p", {className: "roots"});
  const origin = element("p", {className: "faint"});
  const cells = DATA.quantities.map(() => element("td", {className: "value"}));
  const remarks = DATA.quantities.map(() => element("small", {className: "remark"}));
  const rows = DATA.quantities.map((quantity, k) => element("tr", {}, element("th", {scope: "row"}, quantity.name,
    element("small", {}, meaningOf(quantity)), remarks[k]), cells[k], element("td", {}, quantity.share ? "%" : quantity.unit)));
  const heads = ["quantity", "value", "unit"].map((word) => element("th", {scope: "col"}, word));
  host.append(roots, origin);
  if (rows.length) host.append(element("table", {}, element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...rows)));
  return (drawing) => {
    roots.textContent = `${ROOTS}${DATA.rootUnit ? ` in ${DATA.rootUnit}` : ""}: ${rootTexts(drawing).join(", ") || "none"}`;
    origin.hidden = !hasMeeting(drawing.meetings);
    origin.textContent = drawing.known?.roots.length
      ? `These ${ROOTS} are from the solution: where ${ROOTS} meet, ${ROOTS} computed from the parameters scatter.` : `${ROOTS[0].toUpperCase()}${ROOTS.slice(1)} that differ only by rounding are shown as one.`;
    DATA.quantities.forEach(({name, one, share}, k) => {
      const value = drawing.y[k];
      const never = name === "decay_time" && value === Infinity ? "never" : figure((value / one) * (share ? 100 : 1), 5);
      cells[k].textContent = Number.isNaN(value) ? "not defined here" : never;
      remarks[k].textContent = remarkOf(name, value, drawing);
    });
  };
}

/** A fact for readers who have only the page. The method of a proof, and advice on what to do next, are left out. */
function factText(fact, proved) {
  if (!fact.startsWith("proof: ")) return fact.replace(/(^|[\s(])-(?=\d)/g, "$1−");
  return proved ? fact.replace(/ \(\w+\)/g, "") : "not proved";
}

/** The results known before the page was made. Returns a function that marks the design that is shown. */
function knownPanel(host) {
  if (DATA.objective) host.append(element("p", {}, "asked: ", element("code", {}, DATA.objective)));
  const articles = DATA.designs.map((design) => element("article", {},
    element("h3", {}, design.name),
    element("p", {}, [design.structure, `${ABSCISSA} ${withUnit(design.abscissa, DATA.rootUnit)}`].filter(Boolean).join(", ")),
    element("ul", {}, ...design.facts.map((fact) => element("li", {}, factText(fact, design.proved))))));
  const now = element("p", {className: "faint", hidden: !DATA.designs.length});
  host.append(element("div", {className: "designs"}, ...articles), ...DATA.shown.map((sentence) => element("p", {}, sentence)), now);
  return ({known}) => {
    articles.forEach((article, k) => article.classList.toggle("now", DATA.designs[k] === known));
    now.textContent = known ? `Shown now: ${known.name}.` : `The ${NOUN} shown now is none of these.`;
  };
}
