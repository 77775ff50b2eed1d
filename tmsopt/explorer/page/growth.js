// Growth rates and frequencies over one parameter, with events. The picture of the roots uses the same sweep.

const SWEEP_POINTS = 301;
let keptSweep = {key: ""};

/** Coefficients of a design with parameter k at a value. */
function coefficientsAt(x, k, value) {
  const at = Float64Array.from(x);
  at[k] = value;
  const a = new Float64Array(MODEL.degree + 1);
  MODEL.coefficients(at, a);
  return a;
}

/** Find by bisection where a function with few values changes between two ends: [before, after], `width` apart. */
function changesBetween(of, low, high, width) {
  const last = of(high);
  const found = [];
  let [from, held] = [low, of(low)];
  while (held !== last && found.length < 8) {
    let [before, after] = [from, high];
    while (after - before > width) {
      const middle = (before + after) / 2;
      if (middle <= before || middle >= after) break;
      if (of(middle) === held) before = middle;
      else after = middle;
    }
    found.push([before, after]);
    [from, held] = [after, of(after)];
  }
  return found;
}

/**
 * The kind of a change of stability, `weave`, `capsize` or `infinity`. It follows from the coefficient that passes 0.
 * Signs are compared, because products may underflow.
 */
function crossingKind(before, after) {
  if (Math.sign(before[0]) !== Math.sign(after[0])) return "infinity";
  const last = before.length - 1;
  return Math.sign(before[last]) !== Math.sign(after[last]) ? "capsize" : "weave";
}

/** Join the roots of a sweep with im ≥ 0 to curves of pairs and of real roots: {pair, points: [{at, re, im} ..]}. */
function curvesOf(samples) {
  const curves = [];
  let open = [];
  for (const {at, roots} of samples) {
    const points = Array.from(roots.re, (re, k) => ({at, re, im: roots.im[k]})).filter(
      ({re, im}) => Number.isFinite(re) && im >= 0,
    );
    const next = [];
    for (const pairs of [false, true]) {
      const fresh = points.filter(({im}) => im > 0 === pairs);
      const ends = open.filter(({pair}) => pair === pairs);
      const links = ends.flatMap((curve) =>
        fresh.map((point) => {
          const end = curve.points[curve.points.length - 1];
          return {curve, point, apart: Math.hypot(point.re - end.re, point.im - end.im)};
        }),
      );
      links.sort((first, second) => first.apart - second.apart);
      const taken = new Set();
      for (const {curve, point} of links) {
        if (taken.has(curve) || taken.has(point)) continue;
        taken.add(curve).add(point);
        curve.points.push(point);
        next.push(curve);
      }
      for (const point of fresh.filter((one) => !taken.has(one))) {
        const curve = {pair: pairs, points: [point]};
        curves.push(curve);
        next.push(curve);
      }
    }
    open = next;
  }
  for (const {points} of curves) for (const point of points) point.im = heightOf(point.im);
  return curves;
}

/** Number of roots of the polynomial that grow, without roots on the imaginary axis up to rounding. */
function countGrowing({re, im}) {
  const sizes = re.map((part, k) => Math.hypot(part, im[k])).sort();
  return re.filter((part) => part > 1e-7 * sizes[re.length >> 1]).length;
}

/** Intervals [from, to] of a sweep in which `of` is true for all samples. */
function bandsAlong(samples, of) {
  const bands = [];
  samples.forEach((sample, k) => {
    if (!of(sample)) return;
    if (k && of(samples[k - 1])) bands[bands.length - 1][1] = sample.at;
    else bands.push([sample.at, sample.at]);
  });
  return bands;
}

/** Values that approach a centre from both sides. Near an event, roots move like a square root, so steps must shrink. */
function approachingValues(centre, step, [low, high]) {
  const apart = Array.from({length: 14}, (_, k) => step * 0.5 ** k);
  return apart.flatMap((distance) => [centre - distance, centre + distance]).filter((at) => at > low && at < high);
}

/** Compares samples or events by their value of the parameter. */
const byValue = (x, y) => x.at - y.at;

/** Whether sorted samples miss a window of stability, or a gap in one, in which another sample lies. */
function misses(samples, {at, kind}) {
  const next = samples.findIndex((one) => one.at >= at);
  return kind && next > 0 && [next - 1, next].every((k) => samples[k].kind > 2 !== kind > 2);
}

/**
 * Roots, classes, curves and events over the range of the parameter `state.over`. The result is kept until another
 * parameter changes. Events are sorted: {kind, at} in SI units. `meeting`: real roots become a pair; `crossing`: roots
 * pass 0 or infinity, and the design is unstable before and after.
 */
function sweepOf(state) {
  const k = state.over;
  const key = `${k} ${Array.from(state.x, (value, index) => (index === k ? 0 : value))}`;
  const of = (at) => coefficientsAt(state.x, k, at);
  const sampleAt = (at) => {
    const a = of(at);
    const roots = rootsOf(a, true);
    return {at, a, kind: kindOf(a), real: realRootsOf(a), roots, growing: countGrowing(roots)};
  };
  const own = sampleAt(state.x[k]);
  if (keptSweep.key === key && !misses(keptSweep.coarse, own)) return keptSweep;
  const ends = rangeOf(k);
  const width = 1e-10 * (ends[1] - ends[0]);
  // a single undefined sample between two defined samples is a pole, and is left out
  const even = Array.from(evenly(ends, SWEEP_POINTS), sampleAt).filter(
    ({kind}, index, all) => kind || !all[index - 1]?.kind || !all[index + 1]?.kind,
  );
  const known = DATA.designs
    .filter(({values}) => sameBeside(values, state.x, [k], 0))
    .map((design) => ({...design, at: design.values[k]}));
  const missed = [own, ...known.map(({at}) => sampleAt(at))].filter((one) => misses(even, one));
  const coarse = [...even, ...missed].sort(byValue);
  const inside = ({kind, at}) => {
    // crossings are found from computed roots, which are less accurate
    const edge = kind === "crossing" ? 1e4 * width : 10 * width;
    const met = kind === "crossing" && known.some((one) => hasMeeting(one.roots) && Math.abs(one.at - at) < edge);
    return !met && at > ends[0] + edge && at < ends[1] - edge;
  };
  const events = [];
  const samples = [];
  coarse.forEach((sample, index) => {
    if (index) {
      const before = coarse[index - 1];
      const changes = (answer) => changesBetween((at) => answer(of(at)), before.at, sample.at, width);
      const kinds = before.kind === sample.kind ? [] : changes(kindOf);
      const reals = before.real === sample.real ? [] : changes(realRootsOf);
      const near = [...kinds, ...reals].flat().map(sampleAt).sort(byValue);
      samples.push(...near.filter(({at}) => at > before.at && at < sample.at));
      for (const [low, high] of kinds) {
        const first = sampleAt(low);
        const second = [high, high + width].map(sampleAt).find(({kind}) => kind);
        if (first.kind && second && first.kind > 2 !== second.kind > 2) {
          events.push({kind: crossingKind(first.a, second.a), at: (low + high) / 2, gains: second.kind > 2});
        }
      }
      const both = [before, sample].every(({kind}) => kind && kind < 3);
      const growing = (a) => countGrowing(rootsOf(a, true));
      const crossed = both && before.growing !== sample.growing && kinds.length < 2;
      for (const [low, high] of crossed ? changes(growing) : []) {
        const roots = Math.abs(growing(of(high)) - growing(of(low)));
        const far = of(low)[0] > 0 !== of(high)[0] > 0;
        events.push({kind: "crossing", at: (low + high) / 2, roots, far});
      }
      for (const [low, high] of reals) {
        const met = meetingOf(sampleAt(low), sampleAt(high));
        if (met) events.push({kind: "meeting", at: (low + high) / 2, re: met.re});
      }
    }
    samples.push(sample);
  });
  const step = (ends[1] - ends[0]) / (SWEEP_POINTS - 1);
  const centres = new Set([...events, ...known].map(({at}) => at));
  samples.push(...[...centres].flatMap((centre) => approachingValues(centre, step, ends)).map(sampleAt));
  samples.sort(byValue);
  keptSweep = {
    key,
    ends,
    samples,
    known,
    coarse,
    events: events.filter(inside).sort(byValue),
    curves: curvesOf(samples),
    stable: bandsAlong(samples, ({kind}) => kind > 2),
    heavy: bandsAlong(samples, ({kind}) => kind === 4),
  };
  return keptSweep;
}

/** The point where real roots meet between two designs with different numbers of real roots; null at infinity. */
function meetingOf(first, second) {
  if (Math.sign(first.a[0]) !== Math.sign(second.a[0])) return null;
  const {re, im} = (first.real > second.real ? first : second).roots;
  const reals = re.filter((_, k) => im[k] === 0).sort();
  const gaps = Array.from(reals.subarray(1), (root, k) => ({apart: root - reals[k], re: (root + reals[k]) / 2}));
  return gaps.sort((one, other) => one.apart - other.apart)[0] ?? {re: NaN};
}

/** An event in words: "weave ends at v = 4.292 m/s". */
function eventWords({kind, at, gains, roots, far}, over) {
  const where = `at ${symbolOf(over)} = ${valueText(over, at, 7)}`;
  if (kind === "infinity") return `a root passes infinity ${where}, ${gains ? "" : "un"}stable from there`;
  if (OF_H && kind === "crossing") return `${roots > 2 ? `${roots / 2} eigenfrequencies cross` : "an eigenfrequency crosses"} ${AXIS} ${where}`;
  const many = ["a real root crosses", "a pair of roots crosses"][roots - 1] ?? `${roots} roots cross`;
  if (kind === "crossing") return `${many} ${far ? "infinity" : "0"} ${where}`;
  if (OF_H) return `${DATA.words[kind]} ${where}, ${gains ? "stable" : "gain"} from there`;
  return `${DATA.words[kind]} ${gains ? "ends" : "begins"} ${where}`;
}

/** Limits of an axis that show most values and 0, with a margin. */
function limitsOf(values) {
  const sorted = values.filter(Number.isFinite).sort((first, second) => first - second);
  if (!sorted.length) return [-1, 1];
  const at = (share) => sorted[Math.round(share * (sorted.length - 1))];
  const [low, high] = [Math.min(0, at(0.02)), Math.max(0, at(0.98))];
  const room = 0.12 * (high - low) || 1;
  return [low - room, high + room];
}

/** Limits of an axis that show all values, with a margin. */
function limitsOfAll(values) {
  const all = values.filter(Number.isFinite);
  const [low, high] = [Math.min(...all), Math.max(...all)];
  const room = 0.08 * (high - low) || 0.1 * Math.abs(high) || 1;
  return [low - room, high + room];
}

/** Limits of the growth rates of roots at the design and near it, without roots so far away that they would hide 0. */
function growthLimits(here, near, typical) {
  const sizes = near.filter(Number.isFinite).map(Math.abs).sort((first, second) => first - second);
  const far = 4 * Math.max(typical, sizes[sizes.length >> 1] || 0);
  const seen = here.filter((growth) => growth >= -far);
  const [low, high] = limitsOf([...near.filter((growth) => Math.abs(growth) <= far), ...seen]);
  const room = 0.06 * (high - low);
  return [
    Math.min(low, ...seen.map((growth) => growth - room)),
    Math.max(high, ...seen.map((growth) => growth + room)),
  ];
}

/** Fill colours of stable and heavily damped bands, pale enough for curves on top. */
function bandFills(colours) {
  const fills = classFills(colours);
  return [mixed(fills[3], colours.paper, 0.45), mixed(fills[4], colours.paper, 0.3)];
}

/** Growth rates above frequencies over one parameter. */
function growthPicture(host) {
  let now = null;
  let plots = null;
  const surface = canvasIn(host, (width) => clamp(400, 0.95 * width, 640), paint);
  const reading = part(host, "p", {class: "reading"});
  const happens = part(host, "p", {class: "reading"});
  const legend = legendIn(host);
  const says = makeDescriber(surface.canvas);
  surface.canvas.style.touchAction = "pan-y";

  /** The unit of the roots in 1/s at a value of the parameter, or 1 if the model has no unit of time. */
  function rateAt(state, value) {
    const at = Float64Array.from(state.x);
    at[state.over] = value;
    return MODEL.rate(at) || 1;
  }

  /** Growth rate and frequency of a root at a value of the parameter, in their units. */
  function scaled([re, im], at) {
    const rate = rateAt(now.state, at);
    return [re * rate, (im * rate) / (Number.isFinite(MODEL.rate(now.state.x)) ? 2 * Math.PI : 1)];
  }

  /** Growth rates and frequencies of the curves and of the design, [growth, frequency], and the limits of both axes. */
  function motionsOf(state, drawing, sweep) {
    const curves = sweep.curves.map(({pair, points}) => ({
      pair,
      along: points.map(({at, re, im}) => ({at, values: scaled([re, im], at)})),
    }));
    const value = state.x[state.over];
    const roots = drawing.meetings;
    const here = roots.map((root) => ({pair: OF_H || root[1] > 0, times: root[2], values: scaled(root, value)}));
    const room = 0.15 * (sweep.ends[1] - sweep.ends[0]);
    const centres = [value, ...sweep.events.filter(({kind}) => kind !== "meeting").map(({at}) => at)];
    const near = curves.flatMap(({along}) => along.filter(({at}) => centres.some((c) => Math.abs(at - c) < room)));
    const part = (list, k) => list.map(({values}) => values[k]);
    const typical = rateAt(state, value) * typicalSize(roots, ([re]) => Math.abs(re));
    if (OF_H) {
      const all = [...curves.flatMap(({along}) => along), ...here];
      const [growths, [lowest, highest]] = [limitsOfAll([0, ...part(all, 0)]), limitsOfAll(part(all, 1))];
      return {curves, here, growths, lowest, highest};
    }
    return {
      curves,
      here,
      growths: growthLimits(part(here, 0), part(near, 0), typical),
      lowest: 0,
      highest: Math.max(limitsOf(part(near, 1))[1], 1.1 * Math.max(0, ...part(here, 1))),
    };
  }

  function drawCurves(context, plot, curves, lower, colours) {
    for (const {pair, along} of curves) {
      if (lower && !pair) continue;
      const line = along.map(({at, values}) => ({x: plot.x(at), y: plot.y(values[lower])}));
      drawLine(context, line, colours[pair ? "weave" : "real"], 2.2, pair ? DASHES.whole : DASHES.long);
    }
  }

  function drawDesign(context, plot, x, here, lower, colours) {
    drawUpright(context, plot, x, colours.paper, 4);
    drawUpright(context, plot, x, colours.mark, 1.6);
    const left = x > plot.x0 + 0.8 * plot.width;
    context.textAlign = left ? "right" : "left";
    for (const {pair, times, values} of here) {
      if (lower && !pair) continue;
      const y = plot.y(values[lower]);
      drawDot(context, x, y, times > 1 ? 6 : 4, colours.mark, colours.paper);
      if (times > 1) drawText(context, `${times}-fold`, x + (left ? -10 : 10), y + 12, colours);
    }
  }

  function paint(context, width, height) {
    if (!now) return;
    const {state, drawing} = now;
    const colours = currentColours();
    const sweep = sweepOf(state);
    const timed = Number.isFinite(MODEL.rate(state.x));
    const {curves, here, growths, lowest, highest} = motionsOf(state, drawing, sweep);
    const box = {x0: PLOT_LEFT, width: width - PLOT_LEFT - 12};
    const upper = 0.52 * (height - 92);
    plots = [
      plotIn({...box, y0: 36, height: upper}, sweep.ends, growths),
      plotIn({...box, y0: 50 + upper, height: height - 92 - upper}, sweep.ends, [lowest, highest]),
    ];
    exposePlot(surface.canvas, plots[0]);
    plots.forEach((plot, lower) => {
      drawBands(context, plot, sweep, colours);
      clipped(context, plot, () => {
        if (!lower) drawLevel(context, plot, plot.y(0), colours.ink, 1.5);
        drawCurves(context, plot, curves, lower, colours);
        for (const event of sweep.events) drawEvent(context, plot, event, lower, colours);
        for (const {at, roots} of sweep.known)
          for (const root of roots.filter((one) => one[2] > 1 && (!lower || OF_H || one[1])))
            drawDot(context, plot.x(at), plot.y(scaled(root, at)[lower]), 4, colours.paper, colours.ink);
        drawDesign(context, plot, plot.x(state.x[state.over]), here, lower, colours);
      });
      const unit = timed ? (lower ? "Hz" : "1/s") : DATA.rootUnit;
      const labels = OF_H ? ["Im ω (loss negative)", "Re ω"] : ["growth rate Re s", `frequency${timed ? "" : " |Im s|"}`];
      const label = withLabelUnit(labels[lower], unit);
      const {one} = DATA.parameters[state.over];
      const below = lower ? parameterLabel(state.over, plot.width) : "";
      drawAxes(context, plot, {label: below, one}, {label, one: 1}, colours);
    });
    drawNames(context, plots[0], sweep.events, state, colours);
    legend(entriesOf(sweep, colours));
    happens.textContent = sentenceOf(sweep, state, drawing);
    read(state.x[state.over]);
  }

  /** A sentence: the stability if it is the same everywhere, its changes, and some of the values where roots meet. */
  function sentenceOf({ends, events, samples, known}, state, drawing) {
    const over = state.over;
    const {one, unit} = DATA.parameters[over];
    const fate = ({kind, growing}) =>
      kind > 2 ? "stable" : !kind ? "undefined" : growing ? "unstable" : "neither stable nor growing";
    const edge = 1e-6 * (ends[1] - ends[0]);
    const fates = new Set(samples.filter(({at}) => at > ends[0] + edge && at < ends[1] - edge).map(fate));
    const texts = fates.size > 1 ? [] : [`${[...fates][0]} throughout`];
    texts.push(...events.filter(({kind}) => kind !== "meeting").map((event) => eventWords(event, over)));
    // no sweep hits exactly the values where several roots meet, so these come from known designs
    const own = {name: `this ${NOUN}`, at: state.x[over], roots: drawing.meetings};
    const exact = [...known.filter(({at}) => at !== own.at), own].flatMap(({name, at, roots}) =>
      roots.filter((root) => root[2] > 1 && at >= ends[0] && at <= ends[1]).map((root) => ({name, at, root})),
    );
    const apart = ({at}) => exact.every((other) => Math.abs(at - other.at) > 1e-3 * (ends[1] - ends[0]));
    const met = events.filter((event) => event.kind === "meeting" && apart(event)).map(({at}) => figure(at / one, 5));
    const places = `${met.slice(0, 4).join(", ")}${met.length > 4 ? " and more" : ""}${unit ? ` ${unit}` : ""}`;
    if (met.length) texts.push(`${ROOTS} meet at ${places}`);
    for (const {name, at, root} of exact)
      texts.push(`a ${root[2]}-fold ${OF_H ? "eigenfrequency" : root[1] ? "pair" : "root"} at ${valueText(over, at, 5)} (${name})`);
    if (!events.length) texts.push(`no crossing was found at ${SWEEP_POINTS} values`);
    const text = texts.join("; ");
    return `${text[0].toUpperCase() + text.slice(1)}.`;
  }

  function drawBands(context, plot, sweep, colours) {
    const [stable, heavy] = bandFills(colours);
    const undefineds = bandsAlong(sweep.samples, ({kind}) => kind === 0);
    for (const [bands, fill, draw] of [
      [[sweep.ends], mixed(colours.paper, colours.ink, 0.05), drawBox],
      [sweep.stable, stable, drawBox],
      [sweep.heavy, heavy, drawBox],
      [undefineds, colours.line, drawHatch],
    ])
      for (const [from, to] of bands)
        draw(context, plot.x(from), plot.y0, Math.max(1, plot.x(to) - plot.x(from)), plot.height, fill);
  }

  function drawEvent(context, plot, {kind, at, re}, lower, colours) {
    const dash = {weave: DASHES.short, capsize: DASHES.mixed, infinity: DASHES.dots, crossing: DASHES.dots}[kind];
    if (dash) drawUpright(context, plot, plot.x(at), colours[kind === "crossing" ? "faint" : "ink"], 1.3, dash);
    else drawDot(context, plot.x(at), plot.y(lower ? 0 : re * rateAt(now.state, at)), 4, colours.paper, colours.ink);
  }

  /** Write the values of the design and of the events above the plot, in two rows if they are close. */
  function drawNames(context, plot, events, state, colours) {
    const placed = [];
    const place = (text, x, colour) => {
      const half = context.measureText(text).width / 2 + 4;
      const fits = ({y, middle}) =>
        !placed.some((other) => other.y === y && Math.abs(middle - other.middle) < half + other.half);
      const found = [0, 0.5, -0.5, 0.9, -0.9]
        .flatMap((aside) => {
          const middle = clamp(plot.x0 + half - 4, x + aside * half, plot.x0 + plot.width - half + 4);
          return [26, 10].map((y) => ({y, middle, half}));
        })
        .find(fits);
      if (!found) return;
      placed.push(found);
      drawText(context, text, found.middle, found.y, colours, colour);
    };
    context.textAlign = "center";
    const value = (at) => valueText(state.over, at).split(" ")[0];
    const own = plot.x(state.x[state.over]);
    if (own >= plot.x0 && own <= plot.x0 + plot.width) place(value(state.x[state.over]), own, colours.mark);
    for (const {kind, at} of events.filter((event) => DATA.words[event.kind] || event.kind === "infinity")) {
      place(`${kind === "infinity" ? "infinity" : DATA.words[kind]} ${value(at)}`, plot.x(at), colours.ink);
    }
  }

  function entriesOf(sweep, colours) {
    const [stable, heavy] = bandFills(colours);
    const has = (pair) => sweep.curves.some((curve) => curve.pair === pair);
    const met = (kind) => sweep.events.some((event) => event.kind === kind);
    return [
      has(true) && lineEntry(OF_H ? "an eigenfrequency" : "a pair of roots, which swings", colours.weave, 2.2, DASHES.whole),
      has(false) && lineEntry("a real root, which does not", colours.real, 2.2, DASHES.long),
      sweep.stable.length && boxEntry("stable", stable, colours.faint),
      sweep.heavy.length && boxEntry("heavily damped", heavy, colours.faint),
      met("weave") && lineEntry(DATA.words.weave, colours.ink, 1.3, DASHES.short),
      met("capsize") && lineEntry(DATA.words.capsize, colours.ink, 1.3, DASHES.mixed),
      met("infinity") && lineEntry("a root passes infinity", colours.ink, 1.3, DASHES.dots),
      met("crossing") && lineEntry(`${OF_H ? `an eigenfrequency crosses ${AXIS}` : "a root crosses 0 or infinity"}, unstable before and after`, colours.faint, 1.3, DASHES.dots),
      (met("meeting") || sweep.known.some(({roots}) => hasMeeting(roots))) && dotEntry(`${ROOTS} meet`, colours.paper, colours.ink),
      now.state.x[now.state.over] === withinRange(now.state.over, now.state.x[now.state.over])
        ? lineEntry(`this ${NOUN}: drag it`, colours.mark, 1.6, DASHES.whole)
        : lineEntry(`this ${NOUN} is outside of this range`, colours.paper, 0, DASHES.whole),
    ].filter(Boolean);
  }

  /** The roots at a value of the parameter, in words. */
  function read(value) {
    const {state, drawing} = now;
    const own = value === state.x[state.over];
    const a = coefficientsAt(state.x, state.over, value);
    const roots = own ? drawing.meetings : meetingsAt(a);
    const rate = rateAt(state, value);
    const unit = Number.isFinite(MODEL.rate(state.x)) ? "1/s" : DATA.rootUnit;
    const text = rootsInWords(roots, 4, rate);
    const where = `${symbolOf(state.over)} = ${valueText(state.over, value, 5)}`;
    reading.textContent = `${where}: ${designWords(kindOf(a), roots, own ? drawing.known : undefined)}; ${ROOTS} ${withLabelUnit(text || "none", unit)}`;
  }

  const within = (value) => withinRange(now.state.over, value);
  addDesignMoves(
    surface.canvas,
    (px) => [[now.state.over, within(plots[0].valueX(px))]],
    (dx, dy) => {
      const [low, high] = rangeOf(now.state.over);
      return dy ? null : [[now.state.over, within(now.state.x[now.state.over] + (dx * (high - low)) / 200)]];
    },
  );
  surface.canvas.addEventListener("pointermove", (event) => {
    if (plots && !event.buttons) read(within(plots[0].valueX(event.offsetX)));
  });
  surface.canvas.addEventListener("pointerleave", () => now && read(now.state.x[now.state.over]));

  return {
    draw(state, drawing) {
      now = {state, drawing};
      surface.repaint();
      const {name} = DATA.parameters[state.over];
      says(
        `Growth rates and frequencies over ${name}; this ${NOUN} at ${valueText(state.over, state.x[state.over])} is ` +
          `${designWords(drawing.kind, drawing.meetings, drawing.known)}. ${happens.textContent} ` +
          `Left and right arrow keys move ${name}.`,
      );
    },
  };
}
