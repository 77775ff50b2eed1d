// The linear motion after a start, as curves over time, and the clock of the moving bicycle.

const MOTION_POINTS = 601;
const NO_MOTION = "No motion to show: the equations of this design cannot be solved.";
const FALLEN = [Math.PI / 6, Math.PI / 2]; // lean and steer at which the bicycle has fallen; linear equations do not hold there
// `time` is in the unit of the file: s, or √(w/g) without units. `from` is the index of the state that starts at 1, for
// a system of the user. `watchers` are called when the time changes.
const clock = {time: 0, playing: false, slower: 1, from: 0, watchers: []};
let motionKept = {key: ""};

/** Set the time of the clock, and draw everything that shows it. */
function setClock(time) {
  clock.time = time;
  clock.watchers.forEach((watch) => watch());
}

/** Time of the file that is played in a second. A bicycle without units is played as if its wheelbase were 1 m. */
function clockPace(x) {
  return DATA.bicycle && !Number.isFinite(MODEL.rate(x)) ? Math.sqrt(9.81) : 1;
}

/** The unit of time. */
function timeUnit(x) {
  if (Number.isFinite(MODEL.rate(x))) return "s";
  return DATA.bicycle ? "√(w/g)" : DATA.rootUnit && `1/(${DATA.rootUnit})`;
}

/** Names of the coordinates that move. */
function coordinateNames() {
  if (DATA.bicycle) return ["lean", "steer"];
  return Array.from({length: MODEL.size}, (_, k) => `${MODEL.order === 2 ? "coordinate" : "state"} ${k + 1}`);
}

/** Names of the states from which a motion can start. */
function startNames() {
  const names = coordinateNames();
  return MODEL.order === 2 ? [...names, ...names.map((name) => `rate of ${name}`)] : names;
}

/**
 * {A, n, rate, ride} of z' = A z with n states; null if the model has no equations. `rate` converts the time of the file
 * to the time of the model. The last states of a bicycle are its yaw and the sideways position of the rear contact.
 */
function systemOf(x) {
  const A = MODEL.pencil && firstOrder(x);
  if (!A) return null;
  const states = MODEL.size * MODEL.order;
  const rate = Number.isFinite(MODEL.rate(x)) ? MODEL.rate(x) : 1;
  if (!DATA.bicycle) return {A, n: states, rate};
  const ride = new Float64Array(7);
  MODEL.ride(x, ride);
  const n = states + 2;
  const whole = new Float64Array(n * n);
  for (let i = 0; i < states; i += 1) whole.set(A.subarray(i * states, i * states + states), i * n);
  whole[states * n + 1] = ride[2];
  whole[states * n + 3] = ride[3];
  whole[n * n - 2] = ride[4];
  return {A: whole, n, rate, ride};
}

/** The first state: after a lean in degrees and an impulse of steer torque, or for other systems with one state at 1. */
function startIn({n, ride}, {lean, push}) {
  const start = new Float64Array(n);
  if (ride) start.set([(lean * Math.PI) / 180, 0, push * ride[0], push * ride[1]]);
  else start[clock.from] = 1;
  return start;
}

/** The row, with a fraction, in which a size reaches a limit; Infinity if it does not. */
function findFallRow(rows, sizeAt, most) {
  const row = rows.findIndex((k) => sizeAt(k) >= most);
  return row > 0 ? row - (sizeAt(row) - most) / (sizeAt(row) - sizeAt(row - 1)) : row < 0 ? Infinity : 0;
}

/** The motion over a length of the model's time, or null. `at(k, time)` is state k; all other times are in the file's. */
function motionIn({A, n, rate, ride}, start, length) {
  const times = evenly([0, length], MOTION_POINTS);
  const values = flow(A, n, start, times);
  if (!values.every(Number.isFinite)) return null;
  const whole = times[MOTION_POINTS - 1] / rate;
  const at = (k, time) => {
    const place = clamp(0, (time / whole) * (MOTION_POINTS - 1), MOTION_POINTS - 1);
    const row = Math.min(MOTION_POINTS - 2, Math.floor(place));
    const [before, after] = [values[row * n + k], values[(row + 1) * n + k]];
    return before + (place - row) * (after - before);
  };
  const size = (row, k) => Math.abs(values[row * n + k]);
  const rows = Array.from(times.keys());
  const peaks = coordinateNames().map((_, k) => rows.reduce((peak, row) => Math.max(peak, size(row, k)), 0));
  const falls = ride ? FALLEN.map((most, k) => findFallRow(rows, (row) => size(row, k), most)) : [Infinity];
  const fall = Math.min(...falls);
  const high = 0.02 * Math.max(...peaks);
  const last = rows.reverse().find((row) => peaks.some((_, k) => size(row, k) > high)) || 1;
  return {
    at,
    rate,
    peaks,
    seconds: Array.from(times, (time) => time / rate),
    end: whole,
    falls: (fall / (MOTION_POINTS - 1)) * whole,
    reached: times[Math.ceil(fall)] ?? Infinity,
    seen: last / (MOTION_POINTS - 1),
    /** Both contacts, [forward, to the right]. */
    contacts(time) {
      const [forward, yaw, right] = [ride[4] * rate * time, at(n - 2, time), at(n - 1, time)];
      return [[forward, right], [forward + ride[5], right + ride[5] * yaw + ride[6] * at(1, time)]];
    },
  };
}

/** Longest time to compute, in the model's time: until the motion has died out or grown large, or 20 oscillations. */
function computeDuration(drawing, most) {
  const [abscissa, , frequency] = drawing.motion;
  const fades = Math.abs(abscissa) > 0 ? (abscissa < 0 ? 16 : 5) / Math.abs(abscissa) : Infinity;
  const swings = frequency > 0 ? (20 * 2 * Math.PI) / frequency : Infinity;
  const length = Math.min(fades, swings, most);
  return Number.isFinite(length) && length > 0 ? length : 10;
}

/** The motion from the current start, until it has died out or the bicycle has fallen; kept until the design changes. */
function motionFrom(state, drawing) {
  const key = `${clock.from} ${state.lean} ${state.push} ${Array.from(state.x)}`;
  if (motionKept.key === key) return motionKept.found;
  const system = drawing.kind ? systemOf(state.x) : null;
  let found = null;
  if (system) {
    const start = startIn(system, state);
    const timed = DATA.bicycle || Number.isFinite(MODEL.rate(state.x));
    const length = computeDuration(drawing, timed ? 20 * clockPace(state.x) * system.rate : Infinity);
    found = motionIn(system, start, length);
    // computed twice: the second time only until the motion has died out or the bicycle has fallen
    const shorter = found && Math.min(found.reached, drawing.motion[0] < 0 ? 1.1 * found.seen * length : length);
    if (found && shorter < length) found = motionIn(system, start, shorter);
    if (found) found.end = Math.min(found.end, found.falls);
  }
  motionKept = {key, found};
  return found;
}

/** How a motion ends, in words. */
function fateOf(motion, drawing) {
  if (motion.falls < Infinity) return "the bicycle falls";
  return `the motion ${drawing.kind > 2 ? "dies out" : "does not die out"}`;
}

/** The picture of the motion over time, in which the pointer moves the clock. */
function motionPicture(host) {
  if (!MODEL.pencil) {
    const panel = host.closest("section") || host;
    panel.hidden = true;
    return {draw() {}};
  }
  const names = coordinateNames();
  let now = null;
  let plot = null;
  if (!DATA.bicycle) {
    const label = part(part(host, "p", {class: "moves"}), "label", {}, "starts at 1");
    const from = part(label, "select");
    startNames().forEach((name, k) => part(from, "option", {value: k}, name));
    from.addEventListener("change", () => {
      clock.from = Number(from.value);
      setClock(0);
      tell();
    });
  }
  const surface = canvasIn(host, (width) => clamp(220, 0.5 * width, 340), paint);
  const reading = part(host, "p", {class: "reading"});
  const legend = legendIn(host);
  const says = makeDescriber(surface.canvas);
  surface.canvas.style.touchAction = "pan-y";
  clock.watchers.push(() => surface.repaint());

  /** Colour and dash of a coordinate; the first 25 all differ. */
  const lookOf = (k, colours) => [
    [colours.weave, colours.mark, colours.real, colours.complex, colours.ink][k % 5],
    [DASHES.whole, DASHES.long, DASHES.mixed, DASHES.short, DASHES.dots][(k + Math.floor(k / 5)) % 5],
  ];

  function paint(context, width, height) {
    if (!now) return;
    const {state, drawing} = now;
    const colours = currentColours();
    const motion = motionFrom(state, drawing);
    if (!motion) {
      plot = null;
      context.textAlign = "center";
      context.fillStyle = colours.ink;
      context.fillText(NO_MOTION, width / 2, height / 2);
      legend([]);
      reading.textContent = "";
      return;
    }
    const one = DATA.bicycle ? Math.PI / 180 : 1;
    const size = 1.12 * (Math.max(...motion.peaks) || one);
    plot = plotIn(
      {x0: PLOT_LEFT, y0: 8, width: width - PLOT_LEFT - 12, height: height - 50},
      [0, motion.end],
      [-size, size],
    );
    // in the end a motion follows e^(abscissa t), unless the rightmost root is multiple
    const last = rightmostOf(drawing.meetings) - roundingOf(drawing.meetings);
    const lone = drawing.meetings.every(([re, , times]) => times === 1 || re < last);
    const bounded = lone && !isMarginal(drawing.meetings);
    clipped(context, plot, () => {
      drawLevel(context, plot, plot.y(0), colours.faint, 1);
      if (bounded) drawEnvelope(context, motion, drawing.motion[0], colours);
      const rows = Array.from(motion.seconds);
      names.forEach((_, k) => {
        const [colour, dash] = lookOf(k, colours);
        drawLine(
          context,
          rows.map((time) => ({x: plot.x(time), y: plot.y(motion.at(k, time))})),
          colour,
          2.2,
          dash,
        );
      });
      const x = plot.x(Math.min(clock.time, motion.end));
      drawUpright(context, plot, x, colours.ink, 1.4);
    });
    drawAxes(
      context,
      plot,
      {label: withLabelUnit("time", timeUnit(state.x)), one: 1},
      {label: DATA.bicycle ? "angle in degrees" : "displacement", one},
      colours,
    );
    legend([
      ...names.map((name, k) => lineEntry(name, lookOf(k, colours)[0], 2.2, lookOf(k, colours)[1])),
      bounded && lineEntry("within a multiple of e^(abscissa · time)", colours.faint, 1, DASHES.dots),
    ].filter(Boolean));
    read(motion);
  }

  /** Draw the smallest multiple of e^(abscissa t) between whose curves ± the motion stays. */
  function drawEnvelope(context, motion, abscissa, colours) {
    if (!Number.isFinite(abscissa)) return;
    const rows = Array.from(motion.seconds);
    const pace = (time) => Math.exp(abscissa * motion.rate * time);
    const most = Math.max(...names.flatMap((_, k) => rows.map((time) => Math.abs(motion.at(k, time)) / pace(time))));
    const level = (time) => most * pace(time);
    for (const side of [1, -1]) {
      drawLine(
        context,
        rows.map((time) => ({x: plot.x(time), y: plot.y(side * level(time))})),
        colours.faint,
        1,
        DASHES.dots,
      );
    }
  }

  /** Write the coordinates at the time of the clock. */
  function read(motion, time = Math.min(clock.time, motion.end)) {
    const degree = DATA.bicycle ? 180 / Math.PI : 1;
    const values = names.map(
      (name, k) =>
        `${name} = ${figure(Number((degree * motion.at(k, time)).toPrecision(3)), 3)}${DATA.bicycle ? "°" : ""}`,
    );
    reading.textContent = `after ${withUnit(time, timeUnit(now.state.x), 3)}: ${values.join(", ")}`;
  }

  const toTime = (event) => {
    clock.playing = false;
    const motion = motionFrom(now.state, now.drawing);
    if (motion && plot) setClock(clamp(0, plot.valueX(event.offsetX), motion.end));
  };
  acceptKeys(surface.canvas);
  surface.canvas.addEventListener("pointerdown", (event) => {
    surface.canvas.setPointerCapture(event.pointerId);
    toTime(event);
  });
  surface.canvas.addEventListener("pointermove", (event) => event.buttons && toTime(event));
  surface.canvas.addEventListener("keydown", (event) => {
    const by = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    const motion = by && motionFrom(now.state, now.drawing);
    if (!motion) return;
    event.preventDefault();
    clock.playing = false;
    setClock(clamp(0, clock.time + (by * motion.end) / (event.shiftKey ? 20 : 200), motion.end));
  });

  function tell() {
    const motion = motionFrom(now.state, now.drawing);
    const start = DATA.bicycle ? "a lean and a push" : `${startNames()[clock.from]} = 1`;
    says(
      motion
        ? `${names.join(" and ")} over time after ${start}: ${fateOf(motion, now.drawing)}. Arrow keys move the time.`
        : NO_MOTION,
    );
  }

  return {
    draw(state, drawing) {
      now = {state, drawing};
      surface.repaint();
      tell();
    },
  };
}
