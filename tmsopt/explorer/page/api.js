// The functions of the page for other programs, as window.tmsopt. Values are in the units of the file.

const KIND_WORDS = OF_H ? CLASS_WORDS : ["undefined", "capsize", "weave", "stable", "heavily damped"];

window.tmsopt = {
  /** Set parameters by their names. */
  set(values) {
    const wanted = Object.entries(values).map(([name, value]) => {
      const index = DATA.parameters.findIndex((p) => p.name === name);
      if (index < 0) throw new Error(`no parameter ${name}; there are: ${DATA.parameters.map((p) => p.name).join(", ")}`);
      const reason = impossible(DATA.parameters[index], value * DATA.parameters[index].one);
      if (reason) throw new Error(`${name}: ${reason}`);
      return [index, value * DATA.parameters[index].one];
    });
    change({x: wanted});
  },

  /** The design that the page shows, with its roots, stability and quantities. */
  get() {
    const {meetings, motion, kind, y, known} = drawingOf();
    const all = allRoots(meetings);
    const every = [...all.re].map((part, k) => [part, all.im[k]]);
    const named = (list, values) => Object.fromEntries(list.map(({name, one}, k) => [name, values[k] / one]));
    return {
      parameters: named(DATA.parameters, state.x),
      // s = −i ω
      roots: OF_H ? every.map(([loss, frequency]) => [loss, 0 - frequency]) : every,
      abscissa: motion[0],
      ...(OF_H ? {eigenfrequencies: every.map(([loss, frequency]) => [frequency, loss])} : {damping_ratio: motion[1]}),
      kind: isOnEdge(kind, meetings, known) ? edgeWord(meetings, known) : KIND_WORDS[kind],
      quantities: named(DATA.quantities, y),
    };
  },

  /**
   * Lean and steer in rad after a lean in degrees and an impulse of steer torque, for a number of seconds (of √(w/g) if
   * the model has no units). `falls` is the time of the fall, or null. The result is null if the model is no bicycle or
   * its equations cannot be solved.
   */
  motion({lean = state.lean, push = state.push, seconds = 3} = {}) {
    const system = DATA.bicycle && systemOf(state.x);
    if (!system) return null;
    const found = motionIn(system, startIn(system, {lean, push}), seconds * system.rate);
    if (!found) return null;
    const {seconds: t, at, falls} = found;
    const angles = (k) => t.map((time) => at(k, time));
    return {t, phi: angles(0), delta: angles(1), falls: falls < Infinity ? falls : null};
  },
};
