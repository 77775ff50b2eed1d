// The moving bicycle, to scale, from the right side and from behind, and the tracks of its wheels from above.

const SLOWNESS = [1, 2, 5, 10, 50];

/**
 * The geometry of a design. Lengths are in m, or in wheelbases if the model has no units; x is forward, y right, z down.
 */
function bicycleShape(x) {
  const named = Object.fromEntries(DATA.parameters.map(({name}, k) => [name, x[k]]));
  const of = (name, other, instead = 0) => named[name] ?? named[other] ?? instead;
  const w = of("w", "", 1);
  const [front, rear] = [of("r_F", ""), of("r_R", "")];
  const B = [of("x_B", "chi_B"), 0, of("z_B", "zeta_B")];
  const H = [of("x_H", "chi_H"), 0, of("z_H", "zeta_H")];
  const tilt = named.lambda_s;
  const meets = [w + of("c", ""), 0, 0];
  const up = [-Math.sin(tilt), 0, -Math.cos(tilt)];
  const top = Math.max(0.55 * w, 1.12 * Math.max(-B[2], -H[2]), 2.3 * front);
  const onAxis = (length) => meets.map((value, k) => value + length * up[k]);
  const alongAxis = (point) => point.reduce((sum, value, k) => sum + (value - meets[k]) * up[k], 0);
  const tall = top / Math.max(Math.cos(tilt), 0.35);
  const speed = named.v ?? named.Fr ?? 0;
  return {
    w,
    front,
    rear,
    B,
    H,
    meets,
    up,
    top,
    onAxis,
    alongAxis,
    tall,
    speed,
    heavy: of("m_H", "mu", 0) / of("m_B", "", 1),
    trail: of("c", ""),
    contact: [w, 0, 0],
  };
}

/** A point after steering (a rotation about the steer axis) and leaning (a rotation about the line of contacts). */
function movedPoint(shape, point, ofFront, lean, steer) {
  let [x, y, z] = point;
  if (ofFront && steer) {
    // Rodrigues' formula; the axis points down, so that a positive angle steers to the right
    const axis = shape.up.map((value) => -value);
    const arm = [x - shape.meets[0], y - shape.meets[1], z - shape.meets[2]];
    const [cosine, sine] = [Math.cos(steer), Math.sin(steer)];
    const along = (1 - cosine) * arm.reduce((sum, value, k) => sum + value * axis[k], 0);
    const cross = [
      axis[1] * arm[2] - axis[2] * arm[1],
      axis[2] * arm[0] - axis[0] * arm[2],
      axis[0] * arm[1] - axis[1] * arm[0],
    ];
    [x, y, z] = arm.map((value, k) => shape.meets[k] + cosine * value + sine * cross[k] + along * axis[k]);
  }
  return [x, y * Math.cos(lean) - z * Math.sin(lean), y * Math.sin(lean) + z * Math.cos(lean)];
}

/** The lines of the upright bicycle: {front, points, kind}; `front` is true for lines of the front assembly. */
function bicycleLines(shape, travelled) {
  const {w, rear, front, B, H, onAxis, alongAxis, tall, contact} = shape;
  const hub = [0, 0, -rear];
  const frontHub = [w, 0, -front];
  const head = onAxis(0.62 * tall);
  // the point of the steer axis where a part is joined, between the ground and the handlebar
  const joined = (point) => onAxis(clamp(0.04 * tall, alongAxis(point), 0.9 * tall));
  const lowest = [front ? frontHub : contact, H].map(joined).sort((one, other) => other[2] - one[2])[0];
  const lines = [
    {front: false, kind: "frame", points: [hub, B, head]},
    {front: false, kind: "frame", points: [hub, head]},
    {
      front: true,
      kind: "fork",
      points: [front ? frontHub : contact, joined(front ? frontHub : contact)],
    },
    {front: true, kind: "fork", points: [lowest, onAxis(0.9 * tall)]},
    {front: true, kind: "fork", points: [joined(H), H]},
    {
      front: true,
      kind: "fork",
      points: [-0.16, 0.16].map((side) => onAxis(0.9 * tall).map((value, k) => (k === 1 ? side * w : value))),
    },
    {front: false, kind: "axis", points: [onAxis(-0.07 * w), onAxis(1.04 * tall)]},
  ];
  const wheels = [
    [hub, rear, false],
    [frontHub, front, true],
  ];
  for (const [centre, radius, ofFront] of wheels) {
    if (radius > 0) {
      const rim = (angle, part) => [
        centre[0] + part * radius * Math.cos(angle),
        0,
        centre[2] + part * radius * Math.sin(angle),
      ];
      const turned = travelled / radius;
      lines.push({
        front: ofFront,
        kind: "wheel",
        points: Array.from({length: 49}, (_, k) => rim((k * Math.PI) / 24, 1)),
      });
      for (let spoke = 0; spoke < 5; spoke += 1) {
        lines.push({front: ofFront, kind: "spoke", points: [centre, rim(turned + (spoke * 2 * Math.PI) / 5, 0.97)]});
      }
    } else {
      const skate = [-0.06, 0.06, 0.035, -0.035, -0.06];
      const points = skate.map((x) => [centre[0] + x * w, 0, Math.abs(x) > 0.05 ? -0.03 * w : 0]);
      lines.push({front: ofFront, kind: "skate", points});
    }
  }
  return lines;
}

/** The bicycle in motion. */
function bicyclePicture(host) {
  const calm = matchMedia("(prefers-reduced-motion: reduce)");
  let now = null;
  let lastMoment = 0;
  let isStopped = calm.matches;
  let startTimer = 0;
  let lastDesign = "";
  const starts = part(host, "div", {class: "moves"});
  const fields = [
    startField("lean", "start lean", "°", "to the right"),
    startField("push", "steer push", DATA.impulseUnit, "an impulse of steer torque, to the right"),
  ];
  const surface = canvasIn(host, heightOf, paint);
  const above = canvasIn(host, (width) => clamp(150, 0.34 * width, 210), paintTracks);
  const reading = part(host, "p", {class: "reading"});
  const moves = part(host, "div", {class: "moves"});
  const play = part(moves, "button", {type: "button"}, "Play");
  const again = part(moves, "button", {type: "button"}, "Restart");
  const slower = part(part(moves, "label", {}, "shown"), "select");
  const real = clockPace(DATA.start) === 1 ? "in real time" : "in real time, w = 1 m";
  for (const value of SLOWNESS) part(slower, "option", {value}, value > 1 ? `${value} times slower` : real);
  const legend = legendIn(host);
  const says = makeDescriber(surface.canvas);
  const saysAbove = makeDescriber(above.canvas);
  clock.watchers.push(() => {
    surface.repaint();
    above.repaint();
  });

  function paint(context, width, height) {
    if (!now) return;
    const colours = currentColours();
    const motion = motionFrom(now.state, now.drawing);
    const time = motion ? Math.min(clock.time, motion.end) : 0;
    const [lean, steer] = motion ? [motion.at(0, time), motion.at(1, time)] : [0, 0];
    const shape = bicycleShape(now.state.x);
    if (![...shape.B, ...shape.H, ...shape.up, shape.w, shape.trail].every(Number.isFinite)) return;
    const drawn = lean * enlargement(motion);
    const {left, right, side, tallest} = boundsOf(shape);
    const scale = Math.min((width - 24) / (right - left + 2 * side), (height - 46) / tallest);
    const ground = height - 34;
    const spare = width - scale * (right - left + 2 * side);
    const views = [
      {name: "from the right", x: (point) => spare / 3 + (point[0] - left) * scale, from: left, to: right},
      {
        name: "from behind",
        x: (point) => (2 * spare) / 3 + (right - left + side + point[1]) * scale,
        from: -side,
        to: side,
      },
    ];
    views.forEach((view, behind) => {
      const at = (point, ofFront) => {
        const place = movedPoint(shape, point, ofFront, drawn, steer);
        return {x: view.x(place), y: ground + place[2] * scale};
      };
      const ends = behind ? [view.x([0, view.from]), view.x([0, view.to])] : [view.x([view.from]), view.x([view.to])];
      drawGround(context, ends, ground, behind ? 0 : shape.speed * time * scale, colours);
      if (behind) {
        const middle = view.x([0, 0]);
        drawStraight(
          context,
          [middle, ground],
          [middle, ground - 1.08 * shape.top * scale],
          colours.faint,
          1,
          DASHES.dots,
        );
      }
      for (const {front, kind, points} of bicycleLines(shape, shape.speed * time)) {
        const placed = points.map((point) => at(point, front));
        drawPart(context, placed, kind, front, colours);
      }
      const [B, H] = [at(shape.B, false), at(shape.H, true)];
      drawMass(context, B, 0.055 * shape.w * scale, "B", colours.weave, colours);
      drawMass(
        context,
        H,
        0.055 * shape.w * scale * clamp(0.45, Math.cbrt(shape.heavy), 1.2),
        "H",
        colours.mark,
        colours,
        Math.hypot(B.x - H.x, B.y - H.y) < 22,
      );
      if (!behind && shape.trail) drawTrail(context, at(shape.contact), at(shape.meets), colours);
      context.textAlign = "center";
      context.fillStyle = colours.ink;
      context.fillText(view.name, (ends[0] + ends[1]) / 2, height - 9);
    });
    tell(motion, time, lean, steer);
    legend([
      lineEntry("rear frame, centre of mass B", colours.weave, 4, DASHES.whole),
      lineEntry("front assembly, centre of mass H", colours.mark, 3, DASHES.whole),
      lineEntry("steer axis", colours.ink, 1.2, DASHES.mixed),
      lineEntry("track of the rear contact, from above", colours.weave, 2, DASHES.whole),
      lineEntry("track of the front contact", colours.mark, 2, DASHES.long),
    ]);
  }

  /** A field for the lean or the push with which the motion starts. */
  function startField(name, words, unit, title) {
    const label = part(starts, "label", {title}, words);
    const field = part(label, "input", {type: "text", autocomplete: "off"});
    part(label, "span", {class: "unit"}, unit);
    const draw = () => {
      if (document.activeElement !== field) field.value = String(now.state[name]).replaceAll("-", "−");
      field.setAttribute("aria-invalid", "false");
    };
    field.addEventListener("change", () => {
      const value = numberOf(field.value, unit);
      const fit = isStart(name, value);
      field.setAttribute("aria-invalid", String(!fit));
      if (fit) change({[name]: value});
      else say(`${name}: a number is wanted${name === "lean" ? ", of less than 30°" : ""}`);
    });
    return draw;
  }

  /** Draw the tracks of both contacts from above, with the bicycle. The sideways scale fits the picture. */
  function paintTracks(context, width, height) {
    const motion = now && motionFrom(now.state, now.drawing);
    if (!motion) return;
    const colours = currentColours();
    const {w, speed} = bicycleShape(now.state.x);
    const times = motion.seconds.filter((time) => time < motion.end);
    const tracks = [...times, motion.end].map(motion.contacts);
    const sides = [-0.1 * w, 0.1 * w, ...tracks.flat().map(([, right]) => right)];
    const [left, right] = [Math.min(...sides), Math.max(...sides)];
    const room = 0.12 * (right - left);
    const plot = plotIn(
      {x0: PLOT_LEFT, y0: 8, width: width - PLOT_LEFT - 12, height: height - 50},
      [-0.3 * w, Math.max(speed * motion.end + 1.5 * w, 2 * w)],
      [right + room, left - room],
    );
    const at = ([ahead, aside]) => ({x: plot.x(ahead), y: plot.y(aside)});
    const time = Math.min(clock.time, motion.end);
    const [rear, front] = motion.contacts(time);
    clipped(context, plot, () => {
      drawLevel(context, plot, plot.y(0), colours.faint, 1);
      drawLine(context, tracks.map((contacts) => at(contacts[0])), colours.weave, 2);
      drawLine(context, tracks.map((contacts) => at(contacts[1])), colours.mark, 2, DASHES.long);
      drawLine(context, [at(rear), at(front)], colours.ink, 4);
      drawDot(context, ...Object.values(at(rear)), 5, colours.weave, colours.paper);
      drawDot(context, ...Object.values(at(front)), 5, colours.mark, colours.paper);
    });
    const unit = timeUnit(now.state.x) === "s" ? "m" : "w";
    drawAxes(context, plot, {label: `forward in ${unit}`, one: 1}, {label: `right in ${unit}`, one: 1}, colours);
  }

  /** The extent of both views: to the left, to the right, to each side, and up. */
  function boundsOf({w, front, rear, B, H, meets, onAxis, tall, top}) {
    const over = onAxis(1.04 * tall)[0];
    return {
      left: Math.min(-rear, B[0], H[0], over, -0.15 * w) - 0.08 * w,
      right: Math.max(w + front, B[0], H[0], meets[0], over, 1.15 * w) + 0.08 * w,
      side: Math.max(0.36 * w, 0.45 * top),
      tallest: 1.1 * top + 0.06 * w,
    };
  }

  /** The height that the bicycle needs, in steps, so that the page does not move while a slider moves. */
  function heightOf(width) {
    const {left, right, side, tallest} = boundsOf(bicycleShape(now ? now.state.x : DATA.start));
    const wanted = 46 + (tallest * (width - 24)) / (right - left + 2 * side);
    return clamp(140, 40 * Math.ceil((wanted || 0) / 40), 420);
  }

  /** The factor by which the lean is drawn larger, if it is much smaller than the steering. */
  function enlargement(motion) {
    if (!motion || !(motion.peaks[0] > 0)) return 1;
    const ratio = motion.peaks[1] / motion.peaks[0];
    return [1, 2, 5, 10].filter((factor) => factor <= Math.max(1, ratio / 2)).pop();
  }

  function drawGround(context, [from, to], y, shift, colours) {
    drawStraight(context, [from, y], [to, y], colours.faint, 1.5);
    clipped(context, {x0: from, y0: y, width: to - from, height: 7}, () => {
      for (let x = from - (shift % 14) - 14; x < to + 14; x += 14)
        drawStraight(context, [x + 6, y], [x, y + 6], colours.faint, 1);
    });
  }

  function drawPart(context, points, kind, front, colours) {
    const own = front ? colours.mark : colours.weave;
    context.lineCap = "round";
    if (kind === "frame") drawLine(context, points, own, 4);
    if (kind === "fork") drawLine(context, points, own, 3);
    if (kind === "wheel") drawLine(context, points, colours.ink, 2.6);
    if (kind === "spoke") drawLine(context, points, colours.faint, 0.8);
    context.lineCap = "butt";
    if (kind === "axis") drawLine(context, points, colours.ink, 1.2, DASHES.mixed);
    if (kind === "skate") {
      drawLine(context, points, colours.ink, 1.5);
      context.fillStyle = own;
      context.fill();
    }
  }

  /** Draw a centre of mass: a circle in quarters. */
  function drawMass(context, {x, y}, radius, name, colour, colours, left = false) {
    const size = Math.max(5, radius);
    drawDot(context, x, y, size, colours.paper, colours.ink, 1.5);
    context.fillStyle = colour;
    for (const turn of [0, Math.PI]) {
      context.beginPath();
      context.moveTo(x, y);
      context.arc(x, y, size - 0.7, turn, turn + Math.PI / 2);
      context.fill();
    }
    context.textAlign = left ? "right" : "left";
    drawText(context, name, x + (left ? -1 : 1) * (size + 4), y - size - 2, colours);
  }

  function drawTrail(context, contact, meets, colours) {
    drawLine(context, [contact, meets], colours.real, 5);
    context.textAlign = "left";
    drawText(context, "trail", Math.max(contact.x, meets.x) + 5, contact.y - 12, colours);
  }

  function tell(motion, time, lean, steer) {
    const degrees = (angle) => `${figure(Number(((180 / Math.PI) * angle).toFixed(1)))}°`;
    const [enlarged, unit] = [enlargement(motion), timeUnit(now.state.x)];
    reading.textContent = motion
      ? `After ${withUnit(time, unit, 3)} of ${withUnit(motion.end, unit, 3)}: lean ${degrees(lean)}, ` +
        `steer ${degrees(steer)}${enlarged > 1 ? ` (lean drawn ${enlarged} times)` : ""}.` +
        (motion.falls < Infinity ? " It falls: the end is at 30° of lean or 90° of steer." : "")
      : NO_MOTION;
    play.textContent = clock.playing ? "Pause" : "Play";
  }

  function step(moment) {
    const motion = clock.playing && now && motionFrom(now.state, now.drawing);
    if (!motion) return;
    const passed = (Math.min(0.5, (moment - lastMoment) / 1000) * clockPace(now.state.x)) / clock.slower;
    setClock(Math.min(motion.end, clock.time + passed));
    lastMoment = moment;
    if (clock.time < motion.end) requestAnimationFrame(step);
    else stop();
  }

  function start(time) {
    const running = clock.playing;
    clock.playing = true;
    setClock(time);
    if (running) return;
    lastMoment = performance.now();
    requestAnimationFrame(step);
  }

  function stop() {
    clock.playing = false;
    surface.repaint();
  }

  play.addEventListener("click", () => {
    isStopped = clock.playing;
    const motion = now && motionFrom(now.state, now.drawing);
    if (clock.playing) stop();
    else start(motion && clock.time >= motion.end ? 0 : clock.time);
  });
  again.addEventListener("click", () => {
    isStopped = false;
    start(0);
  });
  slower.addEventListener("change", () => {
    clock.slower = Number(slower.value);
  });

  return {
    draw(state, drawing) {
      now = {state, drawing};
      fields.forEach((drawField) => drawField());
      const design = [...state.x, state.lean, state.push].join(" ");
      if (design !== lastDesign) {
        // the motion starts a moment after each change of the design, unless the user has stopped it
        lastDesign = design;
        clock.playing = false;
        clock.time = 0;
        clearTimeout(startTimer);
        startTimer = setTimeout(() => !isStopped && !calm.matches && start(0), 600);
      }
      surface.repaint();
      above.repaint();
      const motion = motionFrom(state, drawing);
      const fate = motion ? `: ${fateOf(motion, drawing)}` : "";
      says(`The bicycle to scale, from the right side and from behind, leaning and steering after a start${fate}.`);
      saysAbove(`The tracks of the rear and of the front contact, seen from above${fate}.`);
    },
  };
}
