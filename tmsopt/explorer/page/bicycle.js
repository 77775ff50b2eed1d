// The bicycle to scale, from the right side and from behind, as it leans and steers after a push.

const SLOWNESS = [1, 2, 5, 10, 50];

/** The bicycle of a design: lengths in m, or in wheelbases where the model has no units; x forward, y right, z down. */
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
  const speed = named.v ?? (named.Fr ?? 0) * Math.sqrt(9.81 * w);
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

/** A point after the front assembly has turned about the steer axis and all has leaned about the line of contacts. */
function movedPoint(shape, point, ofFront, lean, steer) {
  let [x, y, z] = point;
  if (ofFront && steer) {
    // Rodrigues' rotation, positive to the right: about the axis downward
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

/** The lines of the bicycle: {front, points, kind} in its upright place. */
function bicycleLines(shape, travelled) {
  const {w, rear, front, B, H, onAxis, alongAxis, tall, contact} = shape;
  const hub = [0, 0, -rear];
  const frontHub = [w, 0, -front];
  const head = onAxis(0.62 * tall);
  // where the front assembly is joined, between the ground and the handlebar
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
  if (!DATA.bicycle) {
    const panel = host.closest("section") || host;
    panel.hidden = true;
    return {draw() {}};
  }
  const calm = matchMedia("(prefers-reduced-motion: reduce)");
  let now = null;
  let last = 0;
  let stopped = calm.matches;
  let resting = 0;
  let moved = "";
  const surface = canvasIn(host, heightOf, paint);
  const reading = part(host, "p", {class: "reading"});
  const moves = part(host, "div", {class: "moves"});
  const play = part(moves, "button", {type: "button"}, "Play");
  const again = part(moves, "button", {type: "button"}, "Push again");
  const slower = part(part(moves, "label", {}, "shown"), "select");
  for (const value of SLOWNESS) part(slower, "option", {value}, value > 1 ? `${value} times slower` : "in real time");
  const legend = legendIn(host);
  const says = saysIn(surface.canvas);
  clock.watchers.push((pushed) => {
    surface.repaint();
    if (pushed) start(0);
  });

  function paint(context, width, height) {
    if (!now) return;
    const colours = coloursNow();
    const push = pushOf(now.state, now.drawing);
    const time = push ? Math.min(clock.time, push.end) : 0;
    const [lean, steer] = push ? [push.at(0, time), push.at(1, time)] : [0, 0];
    const shape = bicycleShape(now.state.x);
    if (![...shape.B, ...shape.H, ...shape.up, shape.w, shape.trail].every(Number.isFinite)) return;
    const drawn = lean * enlargement(push);
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
    tell(push, time, lean, steer);
    legend([
      lineEntry("rear frame, centre of mass B", colours.weave, 4, DASHES.whole),
      lineEntry("front assembly, centre of mass H", colours.mark, 3, DASHES.whole),
      lineEntry("steer axis", colours.ink, 1.2, DASHES.mixed),
    ]);
  }

  /** What both views must hold: from left to right, to each side, and up. */
  function boundsOf({w, front, rear, B, H, meets, onAxis, tall, top}) {
    const over = onAxis(1.04 * tall)[0];
    return {
      left: Math.min(-rear, B[0], H[0], over, -0.15 * w) - 0.08 * w,
      right: Math.max(w + front, B[0], H[0], meets[0], over, 1.15 * w) + 0.08 * w,
      side: Math.max(0.36 * w, 0.45 * top),
      tallest: 1.1 * top + 0.06 * w,
    };
  }

  /** As high as the bicycle asks for, in steps, so that the page stands still while a slider moves. */
  function heightOf(width) {
    const {left, right, side, tallest} = boundsOf(bicycleShape(now ? now.state.x : DATA.start));
    const wanted = 46 + (tallest * (width - 24)) / (right - left + 2 * side);
    return clamp(140, 40 * Math.ceil((wanted || 0) / 40), 420);
  }

  /** By how much the lean is drawn larger than it is, where steering hides it. */
  function enlargement(push) {
    if (!push || !(push.peaks[0] > 0)) return 1;
    const ratio = push.peaks[1] / push.peaks[0];
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

  /** A centre of mass: a circle in quarters. */
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

  function tell(push, time, lean, steer) {
    const degrees = (angle) => `${figure(Number(((180 / Math.PI) * angle).toFixed(1)))}°`;
    const [rate, unit] = [
      figure((180 / Math.PI) * (push ? push.start : 0), 3),
      Number.isFinite(MODEL.rate(now.state.x)) ? "" : ", for a wheelbase of 1 m",
    ];
    const enlarged = enlargement(push);
    reading.textContent = push
      ? "A push to the right, scaled so that the largest angle is 15° " +
        `(${rate}°/s of ${coordinateNames()[clock.pushed]}). ` +
        `After ${time.toFixed(push.end < 1 ? 3 : 2)} s of ${figure(push.end, 3)} s${unit}: lean ${degrees(lean)}, ` +
        `steer ${degrees(steer)}${enlarged > 1 ? ` (lean drawn ${enlarged} times)` : ""}.`
      : NO_MOTION;
    play.textContent = clock.playing ? "Pause" : "Play";
  }

  function step(moment) {
    const push = clock.playing && now && pushOf(now.state, now.drawing);
    if (!push) return;
    setClock(Math.min(push.end, clock.time + Math.min(0.5, (moment - last) / 1000) / clock.slower));
    last = moment;
    if (clock.time < push.end) requestAnimationFrame(step);
    else stop();
  }

  function start(time) {
    const running = clock.playing;
    clock.playing = true;
    setClock(time);
    if (running) return;
    last = performance.now();
    requestAnimationFrame(step);
  }

  function stop() {
    clock.playing = false;
    surface.repaint();
  }

  play.addEventListener("click", () => {
    stopped = clock.playing;
    const push = now && pushOf(now.state, now.drawing);
    if (clock.playing) stop();
    else start(push && clock.time >= push.end ? 0 : clock.time);
  });
  again.addEventListener("click", () => {
    stopped = false;
    start(0);
  });
  slower.addEventListener("change", () => {
    clock.slower = Number(slower.value);
  });

  return {
    draw(state, drawing) {
      now = {state, drawing};
      const design = Array.from(state.x).join(" ");
      if (design !== moved) {
        // a push follows every change of the design once it has rested, unless the reader wants no motion
        moved = design;
        clock.playing = false;
        clock.time = 0;
        clearTimeout(resting);
        resting = setTimeout(() => !stopped && !calm.matches && start(0), 600);
      }
      surface.repaint();
      const fate = drawing.kind ? `: the motion ${drawing.kind > 2 ? "dies out" : "does not die out"}` : "";
      says(`The bicycle to scale, from the right side and from behind, leaning and steering after a push${fate}.`);
    },
  };
}
