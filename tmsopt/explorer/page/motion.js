// What follows a push: the linear response, as curves over time, and the clock that the bicycle moves by.

const PUSH_POINTS = 601;
const NO_MOTION = "No motion to show: the equations of this design cannot be solved.";
const LARGEST_ANGLE = Math.PI / 12;
const clock = {time: 0, playing: false, slower: 1, pushed: 0, watchers: []};
let pushKept = {key: ""};

/** Set the clock, in seconds of what is shown, and let all who show it draw. */
function setClock(time) {
  clock.time = time;
  clock.watchers.forEach((watch) => watch());
}

/** 1/s per unit of the roots; of a bicycle without units, as if its wheelbase were 1 m. */
function clockRate(x) {
  const rate = MODEL.rate(x);
  if (Number.isFinite(rate)) return rate;
  return DATA.bicycle ? Math.sqrt(9.81) : NaN;
}

/** Names of the coordinates that a push moves. */
function coordinateNames() {
  if (DATA.bicycle) return ["lean", "steer"];
  return Array.from({length: MODEL.size}, (_, k) => `${MODEL.order === 2 ? "coordinate" : "state"} ${k + 1}`);
}

/** How long to look at most, in the model's time: until a push has died out or grown large, not for endless swings. */
function pushLength(drawing, rate) {
  const [abscissa, , frequency] = drawing.motion;
  const fades = Math.abs(abscissa) > 0 ? (abscissa < 0 ? 16 : 3.5) / Math.abs(abscissa) : Infinity;
  const swings = frequency > 0 ? (20 * 2 * Math.PI) / frequency : Infinity;
  const length = Math.min(fades, swings, Number.isFinite(rate) ? 20 * rate : Infinity);
  return Number.isFinite(length) && length > 0 ? length : 10;
}

/** The response to a push on coordinate `clock.pushed`, kept while the design stays, or null; see `scaledPush`. */
function pushOf(state, drawing) {
  const key = `${clock.pushed} ${Array.from(state.x)}`;
  if (pushKept.key === key) return pushKept.found;
  const rate = clockRate(state.x);
  const states = MODEL.size * MODEL.order;
  const start = new Float64Array(states);
  start[MODEL.order === 2 ? MODEL.size + clock.pushed : clock.pushed] = 1;
  let found = null;
  let length = pushLength(drawing, rate);
  // looked at twice: the second time only as long as there is something to see
  for (let look = 0; look < 2 && drawing.kind; look += 1) {
    const times = evenly([0, length], PUSH_POINTS);
    const values = response(state.x, start, times);
    found = values && values.every(Number.isFinite) ? scaledPush(values, times, states, rate) : null;
    if (!found || drawing.motion[0] >= 0) break;
    length *= Math.min(1, 1.1 * found.seen);
  }
  pushKept = {key, found};
  return found;
}

/** The response by seconds, where there are such: {at(k, time), seconds, end, rate, peaks, start}; angles to be seen. */
function scaledPush(values, times, states, rate) {
  const size = MODEL.size;
  const peaks = Array.from({length: size}, (_, k) =>
    times.reduce((peak, _time, row) => Math.max(peak, Math.abs(values[row * states + k])), 0),
  );
  const scale = DATA.bicycle ? LARGEST_ANGLE / Math.max(...peaks, 1e-300) : 1;
  const second = Number.isFinite(rate) ? rate : 1;
  const end = times[PUSH_POINTS - 1] / second;
  const at = (k, time) => {
    const place = clamp(0, (time / end) * (PUSH_POINTS - 1), PUSH_POINTS - 1);
    const row = Math.min(PUSH_POINTS - 2, Math.floor(place));
    const [before, after] = [values[row * states + k], values[(row + 1) * states + k]];
    return scale * (before + (place - row) * (after - before));
  };
  const high = 0.02 * Math.max(...peaks);
  const rows = Array.from(times.keys());
  const last = rows.reverse().find((row) => peaks.some((_, k) => Math.abs(values[row * states + k]) > high)) || 1;
  return {
    at,
    end,
    rate: second,
    peaks: peaks.map((peak) => scale * peak),
    start: scale * second,
    seconds: times.map((time) => time / second),
    seen: last / (PUSH_POINTS - 1),
  };
}

/** Response after a push over time; its pointer moves the clock. */
function motionPicture(host) {
  if (!MODEL.pencil) {
    const panel = host.closest("section") || host;
    panel.hidden = true;
    return {draw() {}};
  }
  const names = coordinateNames();
  let now = null;
  let plot = null;
  const choice = part(host, "p", {class: "moves"});
  const label = part(choice, "label", {}, "push on");
  const pushed = part(label, "select");
  names.forEach((name, k) => part(pushed, "option", {value: k}, name));
  pushed.addEventListener("change", () => {
    clock.pushed = Number(pushed.value);
    clock.watchers.forEach((watch) => watch(true));
  });
  const surface = canvasIn(host, (width) => clamp(220, 0.5 * width, 340), paint);
  const reading = part(host, "p", {class: "reading"});
  const legend = legendIn(host);
  const says = saysIn(surface.canvas);
  surface.canvas.style.touchAction = "pan-y";
  clock.watchers.push(() => surface.repaint());

  /** Colour and dash of a coordinate, of the first 25 no two alike. */
  const lookOf = (k, colours) => [
    [colours.weave, colours.mark, colours.real, colours.complex, colours.ink][k % 5],
    [DASHES.whole, DASHES.long, DASHES.mixed, DASHES.short, DASHES.dots][(k + Math.floor(k / 5)) % 5],
  ];

  function paint(context, width, height) {
    if (!now) return;
    const {state, drawing} = now;
    const colours = coloursNow();
    const push = pushOf(state, drawing);
    if (!push) {
      plot = null;
      context.textAlign = "center";
      context.fillStyle = colours.ink;
      context.fillText(NO_MOTION, width / 2, height / 2);
      legend([]);
      reading.textContent = "";
      return;
    }
    const one = DATA.bicycle ? Math.PI / 180 : 1;
    const size = 1.12 * Math.max(...push.peaks, 1e-300);
    plot = plotIn(
      {x0: PLOT_LEFT, y0: 8, width: width - PLOT_LEFT - 12, height: height - 50},
      [0, push.end],
      [-size, size],
    );
    // a push follows e^(abscissa t) in the end where one root is rightmost, not where some meet there
    const last = rightmostOf(drawing.meetings) - roundingOf(drawing.meetings);
    const lone = drawing.meetings.every(([re, , times]) => times === 1 || re < last);
    const bounded = lone && !isMarginal(drawing.meetings);
    clipped(context, plot, () => {
      drawLevel(context, plot, plot.y(0), colours.faint, 1);
      if (bounded) drawEnvelope(context, push, drawing.motion[0], colours);
      const rows = Array.from(push.seconds);
      names.forEach((_, k) => {
        const [colour, dash] = lookOf(k, colours);
        drawLine(
          context,
          rows.map((time) => ({x: plot.x(time), y: plot.y(push.at(k, time))})),
          colour,
          2.2,
          dash,
        );
      });
      const x = plot.x(Math.min(clock.time, push.end));
      drawUpright(context, plot, x, colours.ink, 1.4);
    });
    const timed = Number.isFinite(MODEL.rate(state.x));
    const time = timed
      ? "time in s"
      : DATA.bicycle
        ? "time in s, for a wheelbase of 1 m"
        : `time${DATA.rootUnit ? ` in 1/(${DATA.rootUnit})` : ""}`;
    drawAxes(
      context,
      plot,
      {label: time, one: 1},
      {label: DATA.bicycle ? "angle in degrees" : "displacement", one},
      colours,
    );
    legend([
      ...names.map((name, k) => lineEntry(name, lookOf(k, colours)[0], 2.2, lookOf(k, colours)[1])),
      bounded && lineEntry("within a multiple of e^(abscissa · time)", colours.faint, 1, DASHES.dots),
    ].filter(Boolean));
    read(push);
  }

  /** The least multiple of e^(abscissa t) that the curves stay within. */
  function drawEnvelope(context, push, abscissa, colours) {
    if (!Number.isFinite(abscissa)) return;
    const rows = Array.from(push.seconds);
    const pace = (time) => Math.exp(abscissa * push.rate * time);
    const most = Math.max(...names.flatMap((_, k) => rows.map((time) => Math.abs(push.at(k, time)) / pace(time))));
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

  /** What the coordinates are at the time of the clock. */
  function read(push, time = Math.min(clock.time, push.end)) {
    const degree = DATA.bicycle ? 180 / Math.PI : 1;
    const values = names.map(
      (name, k) =>
        `${name} = ${figure(Number((degree * push.at(k, time)).toPrecision(3)), 3)}${DATA.bicycle ? "°" : ""}`,
    );
    const second = Number.isFinite(clockRate(now.state.x)) ? " s" : "";
    reading.textContent = `after ${figure(time, 3)}${second}: ${values.join(", ")}`;
  }

  const toTime = (event) => {
    clock.playing = false;
    const push = pushOf(now.state, now.drawing);
    if (push && plot) setClock(clamp(0, plot.valueX(event.offsetX), push.end));
  };
  takesKeys(surface.canvas);
  surface.canvas.addEventListener("pointerdown", (event) => {
    surface.canvas.setPointerCapture(event.pointerId);
    toTime(event);
  });
  surface.canvas.addEventListener("pointermove", (event) => event.buttons && toTime(event));
  surface.canvas.addEventListener("keydown", (event) => {
    const by = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    const push = by && pushOf(now.state, now.drawing);
    if (!push) return;
    event.preventDefault();
    clock.playing = false;
    setClock(clamp(0, clock.time + (by * push.end) / (event.shiftKey ? 20 : 200), push.end));
  });

  return {
    draw(state, drawing) {
      now = {state, drawing};
      surface.repaint();
      const push = pushOf(state, drawing);
      const fate = drawing.kind > 2 ? "dies out" : "does not die out"; // of an undefined design there is no push
      says(
        push
          ? `${names.join(" and ")} over time after a push on ${names[clock.pushed]}: ` +
              `the motion ${fate}. Arrow keys move the time.`
          : NO_MOTION,
      );
    },
  };
}
