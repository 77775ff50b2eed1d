// What is true of the design shown: the verdict, limits, numbers, and what was found out before.

const CLASS_WORDS = ["undefined", DATA.words.capsize, DATA.words.weave, "stable", "heavily damped"];

/** Whether a class is stable. */
function isStableKind(kind) {
  return kind >= 3;
}

/** Words before the rate of the verdict, and the rate itself; NaN where no rate is to be named. */
function verdictOf({kind, motion, meetings}) {
  const [abscissa] = motion;
  const size = Math.max(...meetings.map(([re, im]) => Math.hypot(re, im)));
  const swings = meetings.some(([re, im]) => im && re >= abscissa);
  if (kind === 0) return ["No verdict: a coefficient of the characteristic polynomial is no number, or the leading one is 0", NaN];
  if (kind === 4) return ["Every disturbance dies out and nothing swings, slowest as ", abscissa];
  if (kind === 3) return ["Every disturbance dies out, slowest as ", abscissa];
  const words = kind === 1 && swings ? `${CLASS_WORDS[1]} and ${CLASS_WORDS[2]}` : CLASS_WORDS[kind];
  const word = words[0].toUpperCase() + words.slice(1);
  // what stands on the boundary is computed with an error of either sign
  return abscissa > 1e-6 * size ? [`${word}: a disturbance grows as `, abscissa] : [`${word}: a disturbance does not die out`, NaN];
}

/** How many limits hold, in words; empty where there are none. */
function limitsInWords(y) {
  const broken = DATA.constraints.filter((constraint, k) => !limitHolds(constraint, marginOf(y, k)));
  if (!DATA.constraints.length) return "";
  return broken.length ? `violated: ${broken.map((c) => c.name).join(", ")}` : "all limits hold";
}

/** Margin of a limit in SI: at least 0 where it holds; of an equality the difference. */
function marginOf(y, k) {
  return y[DATA.quantities.length + k];
}

/** Whether a limit holds, to its tolerance. */
function limitHolds({equality, tolerance}, margin) {
  return equality ? Math.abs(margin) <= tolerance : margin >= -tolerance;
}

/** The verdict: class, sentence, abscissa, the known design; returns what draws it and gives its text. */
function verdictPanel(host) {
  const badge = element("strong", {className: "badge"});
  const sentence = element("span", {className: "sentence"});
  const more = element("span", {className: "more"});
  const facts = element("span", {className: "more facts"});
  host.append(badge, " ", sentence, " ", more, facts);
  return (drawing) => {
    const {kind, motion, known, y} = drawing;
    const [words, rate] = verdictOf(drawing);
    const exponent = `${figure(rate, 4)} t`;
    const ends = [withUnit(motion[0], DATA.rootUnit), known ? `${known.name}: ${known.structure}` : "", limitsInWords(y)];
    const rest = [`abscissa ${ends[0]}`, ...ends.slice(1)].filter(Boolean).join(" · ");
    const mark = isStableKind(kind) ? "✓" : kind ? "✗" : "?";
    const unstable = Number.isNaN(rate) ? "not stable" : "unstable";
    badge.textContent = `${mark} ${isStableKind(kind) || !kind ? CLASS_WORDS[kind] : unstable}`;
    badge.dataset.kind = kind;
    sentence.replaceChildren(words, ...(Number.isNaN(rate) ? [] : ["e", element("sup", {}, exponent)]));
    more.textContent = rest;
    const proof = known?.proved;
    facts.textContent = proof ? ` · ${proof}` : "";
    return `${badge.textContent.slice(2)}: ${words}${Number.isNaN(rate) ? "" : `e^(${exponent})`}; ${rest}`;
  };
}

/** Limits with their sign and margin; returns what draws them. */
function limitsPanel(host) {
  host.hidden = !DATA.constraints.length;
  const rows = DATA.constraints.map((constraint) => {
    const words = element("span", {className: "margin"});
    const sign = element("span", {className: "sign", "aria-hidden": "true"});
    const row = element("li", {}, sign, element("span", {}, element("b", {}, constraint.name), " ", element("code", {}, constraint.text)), words);
    return {constraint, row, sign, words};
  });
  host.append(element("ul", {className: "limits"}, ...rows.map((r) => r.row)));
  return ({y}) => rows.forEach(({constraint, row, sign, words}, k) => {
    const margin = marginOf(y, k);
    const holds = limitHolds(constraint, margin);
    row.className = holds ? "holds" : "broken";
    sign.textContent = holds ? "✓" : "✗";
    words.textContent = marginInWords(constraint, margin, holds);
  });
}

/** A margin in words. */
function marginInWords({equality, tolerance, unit, one}, margin, holds) {
  const size = withUnit(Math.abs(margin) / one, unit);
  if (Number.isNaN(margin)) return "undefined here";
  if (Math.abs(margin) <= tolerance) return equality ? "holds" : "holds, and binds";
  if (equality) return `off by ${size}`;
  return holds ? `holds by ${size}` : `violated by ${size}`;
}

/** Roots as text, conjugates and multiple ones together. */
function rootTexts({meetings}) {
  return meetings.map(([re, im, times]) => rootText(re, im) + (times > 1 ? ` (${times}-fold)` : ""));
}

/** A real root, or a conjugate pair. */
function rootText(re, im) {
  if (Number.isNaN(re)) return "none";
  return im ? `${figure(re, 5)} ± ${figure(Math.abs(im), 5)}i` : figure(re, 5);
}

/** Roots and quantities; returns what draws them. */
function quantitiesPanel(host) {
  const roots = element("p", {className: "roots"});
  const origin = element("p", {className: "faint"});
  const cells = DATA.quantities.map(() => element("td", {className: "value"}));
  const rows = DATA.quantities.map(({name, unit, meaning, share}, k) => element("tr", {},
    element("th", {scope: "row"}, name, element("small", {}, meaning)), cells[k], element("td", {}, share ? "%" : unit)));
  const heads = ["quantity", "value", "unit"].map((word) => element("th", {scope: "col"}, word));
  host.append(roots, origin);
  if (rows.length) host.append(element("table", {}, element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...rows)));
  return (drawing) => {
    roots.textContent = `roots${DATA.rootUnit ? ` in ${DATA.rootUnit}` : ""}: ${rootTexts(drawing).join(", ") || "none"}`;
    origin.textContent = drawing.known?.roots.length
      ? `As they were found (${drawing.known.name}): where roots meet, computed ones scatter.`
      : "Computed; those that rounding alone keeps apart are taken for one.";
    DATA.quantities.forEach(({one, share}, k) => {
      cells[k].textContent = figure((drawing.y[k] / one) * (share ? 100 : 1), 5);
    });
  };
}

/** What was found out before the page was made; returns what marks the design shown. */
function knownPanel(host) {
  if (DATA.objective) host.append(element("p", {}, "asked: ", element("code", {}, DATA.objective)));
  const articles = DATA.designs.map((design) => element("article", {},
    element("h3", {}, design.name),
    element("p", {}, [design.structure, `abscissa ${withUnit(design.abscissa, DATA.rootUnit)}`].filter(Boolean).join(", ")),
    element("ul", {}, ...design.facts.map((fact) => element("li", {}, fact)))));
  const now = element("p", {className: "faint"});
  host.append(...articles, ...DATA.shown.map((sentence) => element("p", {}, sentence)), now);
  return ({known}) => {
    articles.forEach((article, k) => article.classList.toggle("now", DATA.designs[k] === known));
    now.textContent = known
      ? `Shown now: ${known.name}. Which of its roots meet was found out before, with multiplicities; computed roots do not judge it.`
      : "The design shown now is none of these: its class is judged by signs of its coefficients, its roots are computed.";
    now.hidden = !DATA.designs.length;
  };
}
