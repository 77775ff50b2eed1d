// Roots, classes of stability and motion. Coefficients are in arrays, from the highest power down. Functions that are
// called for every design of a chart write to existing arrays, so that no memory is allocated.

const IS_QUARTIC = MODEL.degree === 4;
const GOOD = 4e-15; // backward error below which no further step is made
const ACCEPTED = 5e-14; // backward error above which the search starts again

// ---- powers of two ------------------------------------------------------------------------------

const BITS = new DataView(new ArrayBuffer(8));

/** The k of 2^k ≤ |x| < 2^(k + 1). */
function exponentOf(x) {
  BITS.setFloat64(0, x);
  return ((BITS.getUint16(0) >> 4) & 2047) - 1023;
}

/** x 2^k, without rounding unless the result is denormal. */
function scaledBy(x, k) {
  for (; k > 1000; k -= 1000) x *= 2 ** 1000;
  for (; k < -1000; k += 1000) x *= 2 ** -1000;
  BITS.setInt32(0, (k + 1023) << 20);
  BITS.setInt32(4, 0);
  return x * BITS.getFloat64(0);
}

// ---- roots: all real factors are improved together ----------------------------------------------

// Factors s² + p s + q, a factor s + lone for odd degrees, and the number of roots at 0, in units of 2^unit.
const FOUND = {
  p: new Float64Array(6), q: new Float64Array(6), lone: 0, pairs: 0, odd: 0, zeros: 0, unit: 0, error: NaN,
};
const BEST = { p: new Float64Array(6), q: new Float64Array(6), lone: 0 };
const MONIC = new Float64Array(13), REBUILT = new Float64Array(13), TERMS = new Float64Array(13);
const RE = new Float64Array(12), IM = new Float64Array(12);
const PAIR = new Float64Array(4), RADIUS = new Float64Array(12);
const START = new Float64Array(9), LATER = new Float64Array(5);
const LATER_P = new Float64Array(6), LATER_Q = new Float64Array(6);
const GOLDEN = 0.6180339887498949;

/** Whether a polynomial has roots: its coefficients are finite, and its leading coefficient is not 0. */
function isRegular(a) {
  for (let k = 0; k < a.length; k++) if (!Number.isFinite(a[k])) return false;
  return a[0] !== 0;
}

/** Factor a polynomial into FOUND. `quick`: start from the factors in FOUND, of a nearby polynomial; use only doubles. */
function factor(a, quick) {
  if (!(IS_QUARTIC && a.length === 5 && factorQuartic(a))) factorAny(a, quick);
}

/** Like `factor`, for every degree. */
function factorAny(a, quick) {
  const n = makeMonic(a), near = quick && FOUND.pairs === n >> 1 && FOUND.odd === (n & 1) && FOUND.error <= ACCEPTED;
  FOUND.pairs = n >> 1;
  FOUND.odd = n & 1;
  FOUND.error = Infinity;
  if (near) improveFactors(n, 9);
  if (FOUND.error > ACCEPTED) {
    startFactors(n);
    improveFactors(n, 40);
  }
  if (!quick && FOUND.error > ACCEPTED) refineRoots(n);
}

/** Factor by the closed form and a few steps of Newton's method; false if the factors do not reproduce the polynomial. */
function factorQuartic(a) {
  quarticStart(a[0], a[1], a[2], a[3], a[4], START);
  let error = START[8];
  for (let k = 0; k < QUARTIC.steps && !(error <= QUARTIC.good); k++) {
    quarticStep(START[0], START[1], START[2], START[3], START[4], START[5], START[6], START[7], LATER);
    if (!(LATER[4] < error)) break;
    for (let i = 0; i < 4; i++) START[4 + i] = LATER[i];
    error = LATER[4];
  }
  if (!(error <= QUARTIC.accepted)) return false;
  FOUND.p[0] = START[4];
  FOUND.q[0] = START[5];
  FOUND.p[1] = START[6];
  FOUND.q[1] = START[7];
  FOUND.pairs = 2;
  FOUND.odd = FOUND.zeros = FOUND.unit = 0;
  FOUND.error = error;
  return true;
}

/** Make the polynomial monic, without roots at 0, in a unit near the mean size of the roots; return its degree. */
function makeMonic(a) {
  let n = a.length - 1;
  while (a[n] === 0) n--;
  FOUND.zeros = a.length - 1 - n;
  const e = exponentOf(a[0]), lead = scaledBy(a[0], -e);
  const unit = n ? Math.round((Math.log2(Math.abs(a[n])) - Math.log2(Math.abs(a[0]))) / n) : 0;
  for (let k = 0; k <= n; k++) MONIC[k] = scaledBy(a[k], -e - k * unit) / lead;
  if (unit !== FOUND.unit) FOUND.error = Infinity; // the factors in FOUND have another unit
  FOUND.unit = unit;
  return n;
}

/** Copy factors. */
function copyFactors(from, to) {
  to.p.set(from.p);
  to.q.set(from.q);
  to.lone = from.lone;
}

/** Find factors by the method of Ehrlich and Aberth: roots start on the circles of Newton's polygon, and repel each other. */
function startFactors(n) {
  for (let i = 0, next; i < n; i = next) {
    let steepest = -Infinity;
    for (let j = i + 1; j <= n; j++) {
      const slope = (Math.log2(Math.abs(MONIC[j])) - Math.log2(Math.abs(MONIC[i]))) / (j - i);
      if (slope >= steepest) {
        steepest = slope;
        next = j;
      }
    }
    for (let k = i; k < next; k++) {
      const turn = 2 * Math.PI * ((k - i) / (next - i) + GOLDEN * i) + 0.7;
      RE[k] = 2 ** steepest * Math.cos(turn);
      IM[k] = 2 ** steepest * Math.sin(turn);
    }
  }
  let moving = (1 << n) - 1;
  for (let round = 0; moving && round < 80; round++) {
    for (let k = 0; k < n; k++) if ((moving >> k) & 1 && !moveRoot(n, k)) moving &= ~(1 << k);
  }
  pairRoots(n);
}

/** Move root k by one step; false if the value of the polynomial there is only rounding. */
function moveRoot(n, k) {
  const x = RE[k], y = IM[k], modulus = Math.hypot(x, y);
  let u = 0, v = 0, du = 0, dv = 0, size = 0;
  for (let i = 0; i <= n; i++) {
    [du, dv] = [du * x - dv * y + u, du * y + dv * x + v];
    [u, v] = [u * x - v * y + MONIC[i], u * y + v * x];
    size = size * modulus + Math.abs(MONIC[i]);
  }
  if (u * u + v * v <= (n * 1e-16 * size) ** 2) return false;
  // The step is 1/(p'/p − Σ 1/(z − other)).
  const value = u * u + v * v;
  let re = (du * u + dv * v) / value, im = (dv * u - du * v) / value;
  for (let j = 0; j < n; j++) {
    if (j === k) continue;
    const a = x - RE[j], b = y - IM[j], square = a * a + b * b + 1e-300;
    re -= a / square;
    im += b / square;
  }
  const square = re * re + im * im;
  if (!(square > 0 && square < Infinity)) return false;
  RE[k] -= re / square;
  IM[k] += im / square;
  return true;
}

/** Combine conjugate roots, and then neighbouring real roots, into factors. */
function pairRoots(n) {
  const left = [...Array(n).keys()].sort((i, j) => Math.abs(IM[j]) - Math.abs(IM[i])), real = [];
  let pairs = 0;
  while (left.length) {
    const i = left.shift();
    const far = (j) => Math.hypot(RE[i] - RE[j], IM[i] + IM[j]);
    const place = left.reduce((best, j, at) => (best < 0 || far(j) < far(left[best]) ? at : best), -1);
    if (place < 0 || far(left[place]) > 2 * Math.abs(IM[i])) real.push(RE[i]);
    else {
      const [j] = left.splice(place, 1);
      FOUND.p[pairs] = -(RE[i] + RE[j]);
      FOUND.q[pairs++] = RE[i] * RE[j] - IM[i] * IM[j];
    }
  }
  real.sort((x, y) => x - y);
  const m = real.length;
  if (n & 1) FOUND.lone = -(m > 1 && real[1] - real[0] < real[m - 1] - real[m - 2] ? real.pop() : real.shift());
  for (let k = 0; k + 1 < m; k += 2) {
    FOUND.p[pairs] = -(real[k] + real[k + 1]);
    FOUND.q[pairs++] = real[k] * real[k + 1];
  }
}

/** Make steps while they help; leave the best factors and their error in FOUND. */
function improveFactors(n, steps) {
  let worse = 0;
  for (let k = 0; ; k++) {
    const error = multiplyFactors(n);
    if (error < FOUND.error) {
      FOUND.error = error;
      copyFactors(FOUND, BEST);
      worse = 0;
    } else worse++;
    if (error <= GOOD || k === steps || !(error < Infinity) || (FOUND.error < 1e-9 && worse > 4)) break;
    correctFactors(n);
  }
  if (FOUND.error < Infinity) copyFactors(BEST, FOUND);
}

/** Multiply the factors into REBUILT; return its largest error, relative to the terms of its sums. */
function multiplyFactors(n) {
  const { p, q, pairs } = FOUND;
  REBUILT.fill(0);
  TERMS.fill(0);
  REBUILT[0] = TERMS[0] = 1;
  for (let k = 0; k < pairs; k++) {
    const Q = Math.abs(q[k]), P = Math.max(Math.abs(p[k]), 2 * Math.sqrt(Q));
    for (let i = 2 * k + 2; i > 1; i--) {
      REBUILT[i] += p[k] * REBUILT[i - 1] + q[k] * REBUILT[i - 2];
      TERMS[i] += P * TERMS[i - 1] + Q * TERMS[i - 2];
    }
    REBUILT[1] += p[k];
    TERMS[1] += P;
  }
  if (FOUND.odd) {
    for (let i = n; i > 0; i--) {
      REBUILT[i] += FOUND.lone * REBUILT[i - 1];
      TERMS[i] += Math.abs(FOUND.lone) * TERMS[i - 1];
    }
  }
  let error = 0;
  for (let i = 1; i <= n; i++) {
    const off = MONIC[i] - REBUILT[i];
    if (off !== 0) error = Math.max(error, Math.abs(off) / TERMS[i]);
  }
  return error;
}

/**
 * A step of Newton's method on all factors at once. The change of a factor solves (change) × (product of the other
 * factors) ≡ (remainder), modulo the factor.
 */
function correctFactors(n) {
  const { p, q, pairs, lone } = FOUND;
  let slope = 0, value = 1;
  if (FOUND.odd) {
    let left = 0, others = 1;
    for (let i = 1; i <= n; i++) left = MONIC[i] - REBUILT[i] - lone * left;
    for (let j = 0; j < pairs; j++) others *= lone * lone - p[j] * lone + q[j];
    value = left / others;
  }
  const step = value;
  for (let k = 0; k < pairs; k++) {
    const P = p[k], Q = q[k];
    let r1 = 0, r0 = 0;
    for (let i = 1; i <= n; i++) {
      const next = r0 - P * r1;
      r0 = MONIC[i] - REBUILT[i] - Q * r1;
      r1 = next;
    }
    slope = FOUND.odd;
    value = FOUND.odd ? lone : 1;
    for (let j = 0; j < pairs; j++) {
      if (j === k) continue;
      const u = p[j] - P, v = q[j] - Q, high = slope * u;
      slope = slope * v + value * u - P * high;
      value = value * v - Q * high;
    }
    const turned = value - P * slope, determinant = value * turned + Q * slope * slope;
    LATER_P[k] = P + (r1 * value - slope * r0) / determinant;
    LATER_Q[k] = Q + (turned * r0 + Q * slope * r1) / determinant;
  }
  p.set(LATER_P);
  q.set(LATER_Q);
  if (FOUND.odd) FOUND.lone += step;
}

/** The method of `startFactors` with 320 binary digits, for roots that meet, where doubles have too few digits. */
function refineRoots(n) {
  const one = 1n << 320n, tiny = 1n << 240n;
  const fixed = (x) => {
    const [mantissa, exponent] = toInteger(x), shift = exponent + 320;
    return shift < 0 ? mantissa >> BigInt(-shift) : mantissa << BigInt(shift);
  };
  const monic = Array.from(MONIC.subarray(0, n + 1), fixed);
  const re = Array.from(RE.subarray(0, n), fixed), im = Array.from(IM.subarray(0, n), fixed);
  for (let moved = one, round = 0; moved > tiny && round < 100; round++) {
    moved = 0n;
    for (let k = 0; k < n; k++) {
      const x = re[k], y = im[k];
      let u = 0n, v = 0n, du = 0n, dv = 0n;
      for (const c of monic) {
        [du, dv] = [((du * x - dv * y) >> 320n) + u, ((du * y + dv * x) >> 320n) + v];
        [u, v] = [((u * x - v * y) >> 320n) + c, (u * y + v * x) >> 320n];
      }
      // The step is p/(p' − p Σ 1/(z − other)).
      let a = 0n, b = 0n;
      for (let j = 0; j < n; j++) {
        const c = x - re[j], d = y - im[j], square = c * c + d * d;
        if (square) [a, b] = [a + ((c << 640n) / square), b - ((d << 640n) / square)];
      }
      const c = du - ((u * a - v * b) >> 320n), d = dv - ((u * b + v * a) >> 320n), square = c * c + d * d;
      if (!square) continue;
      const dx = ((u * c + v * d) << 320n) / square, dy = ((v * c - u * d) << 320n) / square;
      re[k] -= dx;
      im[k] -= dy;
      for (const size of [dx, -dx, dy, -dy]) if (size > moved) moved = size;
    }
  }
  for (let k = 0; k < n; k++) [RE[k], IM[k]] = [scaledBy(Number(re[k]), -320), scaledBy(Number(im[k]), -320)];
  pairRoots(n);
  improveFactors(n, 0);
}

// ---- signs: computed exactly if rounding could change them --------------------------------------

/** A double as an integer times a power of two. */
function toInteger(x) {
  BITS.setFloat64(0, x);
  const bits = BITS.getBigUint64(0), exponent = Number((bits >> 52n) & 2047n), fraction = bits & 0xfffffffffffffn;
  const mantissa = exponent ? fraction | 0x10000000000000n : fraction;
  return [x < 0 ? -mantissa : mantissa, Math.max(exponent, 1) - 1075];
}

// Numbers of different negative and positive real roots; sign changes of Sturm's chain at −∞, 0 and ∞.
const COUNT = { negative: 0, positive: 0 }, CHANGES = { left: 0, middle: 0, right: 0 };
const CHAIN = [0, 1, 2].map(() => ({ value: new Float64Array(13), error: new Float64Array(13) }));
const UNIT = 2 ** -51; // four times the rounding error of an operation, to include the rounding of the bounds
const HALVED = Array.from({ length: 13 }, (_, n) => new Float64Array(n + 1));

/** Class code: 0 undefined, 1 capsize, 2 weave, 3 stable, 4 heavily damped. It follows from signs only. */
function kindOf(a) {
  if (!isRegular(a)) return 0;
  if (IS_QUARTIC) {
    const found = quarticClass(a[0], a[1], a[2], a[3], a[4]);
    if (found < 64) return found & 7;
  }
  const n = a.length - 1, stable = isStable(a);
  countReal(a, stable ? n : 1);
  if (stable) return COUNT.negative === n ? 4 : 3;
  return COUNT.positive > 0 || a[n] === 0 ? 1 : 2;
}

/** Number of different real roots, from signs only; 0 if there are no roots. */
function realRootsOf(a) {
  if (!isRegular(a)) return 0;
  if (IS_QUARTIC) {
    const found = quarticClass(a[0], a[1], a[2], a[3], a[4]);
    if (found < 64) return found >> 3;
  }
  countReal(a, 0);
  return COUNT.negative + COUNT.positive + (a[a.length - 1] === 0 ? 1 : 0);
}

/** Whether all real parts are negative. Up to degree 4 the conditions are rounded, as in the package; above they are exact. */
function isStable(a) {
  if (a.length <= 5) return stableBySigns(a[0], a[1], a[2], a[3], a[4]);
  const n = a.length - 1, up = a[0] > 0, f = CHAIN[0], g = CHAIN[1];
  for (let k = 1; k <= n; k++) if (!(up ? a[k] > 0 : a[k] < 0)) return false;
  f.error.fill(0);
  g.error.fill(0);
  f.value.fill(0);
  g.value.fill(0);
  for (let k = 0; k <= n; k++) (k & 1 ? g : f).value[k - (k & 1)] = k & 2 ? -a[k] : a[k];
  if (!signChanges(n)) {
    const whole = toIntegers(a).map((x, k) => (k & 2 ? -x : x));
    exactSignChanges(whole.map((x, k) => (k & 1 ? 0n : x)), whole.slice(1).map((x, k) => (k & 1 ? 0n : x)));
  }
  return CHANGES.left - CHANGES.right === n;
}

/**
 * Count the real roots other than 0: by Descartes' rule, by Sturm's chain, by discs around computed roots, or, if none of
 * these decides, with integers.
 * `enough`: 0 counts all; 1 asks only if a root is positive; a larger number asks only if so many roots are negative.
 */
function countReal(a, enough) {
  let n = a.length - 1;
  while (a[n] === 0) n--;
  let odd = 0, up = 0, down = 0;
  for (let k = 1, last = 0; k <= n; k++) {
    if (a[k] === 0) continue;
    odd |= k;
    const turned = a[k] > 0 !== a[last] > 0;
    if (turned) up++;
    if (turned !== ((k - last) & 1) > 0) down++;
    last = k;
  }
  COUNT.positive = up;
  COUNT.negative = down;
  if ((up <= 1 && down <= 1) || (enough === 1 && (up === 0 || up & 1)) || (enough > 1 && down < enough)) return;
  if (enough > 1 && hasPair(a, n)) {
    COUNT.negative = 0;
    return;
  }
  if (!(odd & 1)) {
    const half = HALVED[n >> 1];
    for (let k = 0; k <= n; k += 2) half[k >> 1] = a[k];
    countReal(half, 0);
    COUNT.negative = COUNT.positive;
    return;
  }
  const f = CHAIN[0], g = CHAIN[1];
  for (let k = 0; k <= n; k++) {
    f.value[k] = a[k];
    f.error[k] = 0;
    g.value[k] = a[k] * (n - k);
    g.error[k] = UNIT * Math.abs(g.value[k]);
  }
  if (signChanges(n) < 2) {
    if (discs(a)) return;
    const whole = toIntegers(a.slice(0, n + 1));
    exactSignChanges(whole, whole.slice(0, n).map((x, k) => x * BigInt(n - k)));
  }
  COUNT.negative = CHANGES.left - CHANGES.middle;
  COUNT.positive = CHANGES.middle - CHANGES.right;
}

/** Whether some roots are certainly not real, by Newton's inequalities between neighbouring coefficients. */
function hasPair(a, n) {
  for (let k = 1; k < n; k++) {
    const most = a[k] * a[k] * (k * (n - k)), least = a[k - 1] * a[k + 1] * ((k + 1) * (n - k + 1));
    if (least > 1e-280 && most < (1 - 1e-14) * least) return true;
  }
  return false;
}

/**
 * Sign changes along the chain of remainders of two polynomials of degrees n and n − 1, with bounds of all rounding.
 * Returns 2 if all signs are certain, 1 if only signs at 0 are uncertain, otherwise 0.
 */
function signChanges(n) {
  let p = CHAIN[0], q = CHAIN[1], r = CHAIN[2], certain = 2;
  CHANGES.left = CHANGES.middle = CHANGES.right = 0;
  for (let d = n; ; d--) {
    const P = p.value, Q = q.value, E = q.error, lead = Q[0], room = Math.abs(lead) - E[0];
    if (!(room > 0)) return 0;
    if (P[0] > 0 === lead > 0) CHANGES.left++;
    else CHANGES.right++;
    if (!(Math.abs(Q[d - 1]) > E[d - 1])) certain = 1;
    if (P[d] > 0 !== Q[d - 1] > 0) CHANGES.middle++;
    if (d === 1) return certain;
    const R = r.value, F = r.error, first = P[0] / lead;
    const firstError = (p.error[0] + Math.abs(first) * E[0]) / room + UNIT * Math.abs(first);
    for (let i = 1; i <= d; i++) {
      const part = i < d ? first * Q[i] : 0, rest = P[i] - part, size = i < d ? Math.abs(Q[i]) : 0;
      R[i - 1] = rest;
      F[i - 1] = p.error[i] + UNIT * (Math.abs(part) + Math.abs(rest));
      if (i < d) F[i - 1] += Math.abs(first) * E[i] + (size + E[i]) * firstError;
    }
    const second = R[0] / lead, secondError = (F[0] + Math.abs(second) * E[0]) / room + UNIT * Math.abs(second);
    let largest = 0;
    for (let i = 1; i < d; i++) {
      const part = second * Q[i], rest = part - R[i];
      F[i - 1] = F[i] + Math.abs(second) * E[i] + (Math.abs(Q[i]) + E[i]) * secondError;
      F[i - 1] += UNIT * (Math.abs(part) + Math.abs(rest));
      R[i - 1] = rest;
      largest = Math.max(largest, Math.abs(rest));
    }
    const down = largest > 0 && largest < Infinity ? scaledBy(1, -exponentOf(largest)) : 1;
    for (let i = 0; i < d - 1; i++) {
      R[i] *= down;
      F[i] = F[i] * down + 1e-300; // bound of underflow
    }
    [p, q, r] = [q, r, p];
  }
}

/** Count real roots by discs with one root each; false if discs touch each other or 0, or contain non-real points only. */
function discs(a) {
  factorAny(a, true);
  const n = 2 * FOUND.pairs + FOUND.odd;
  for (let k = 0; k < FOUND.pairs; k++) {
    factorRoots(FOUND.p[k], FOUND.q[k], PAIR);
    for (const i of [0, 1]) [RE[2 * k + i], IM[2 * k + i]] = [PAIR[2 * i], PAIR[2 * i + 1]];
  }
  if (FOUND.odd) [RE[n - 1], IM[n - 1]] = [-FOUND.lone, 0];
  COUNT.negative = COUNT.positive = 0;
  for (let k = 0; k < n; k++) {
    const x = RE[k], y = IM[k], modulus = Math.hypot(x, y);
    let u = 0, v = 0, size = 0, others = 1;
    for (let i = 0; i <= n; i++) {
      const next = u * x - v * y + MONIC[i];
      v = u * y + v * x;
      u = next;
      size = size * modulus + Math.abs(MONIC[i]);
    }
    for (let j = 0; j < n; j++) if (j !== k) others *= Math.hypot(x - RE[j], y - IM[j]);
    const rounding = 8 * n * 2 ** -52 * size; // bound of the rounding of Horner's rule, with a margin
    RADIUS[k] = (1.001 * n * (Math.hypot(u, v) + rounding)) / others;
    if (!((y === 0 ? Math.abs(x) : Math.abs(y)) > RADIUS[k])) return false;
    for (let j = 0; j < k; j++) {
      if (!(Math.hypot(x - RE[j], y - IM[j]) > 1.001 * (RADIUS[k] + RADIUS[j]))) return false;
    }
    if (y === 0 && x < 0) COUNT.negative++;
    if (y === 0 && x > 0) COUNT.positive++;
  }
  return true;
}

/** Coefficients as integers, all multiplied by the same power of two. */
function toIntegers(a) {
  const parts = Array.from(a, toInteger), least = Math.min(...parts.map(([m, e]) => (m ? e : Infinity)));
  return parts.map(([m, e]) => (m ? m << BigInt(e - least) : 0n));
}

/** Like `signChanges`, but exact. Degrees may fall by more than one, and the chain may end early. */
function exactSignChanges(p, q) {
  const sign = (x) => (x > 0n ? 1 : x < 0n ? -1 : 0), size = (x) => (x < 0n ? -x : x);
  const ends = [[], [], []];
  let divisor = 1n;
  for (;;) {
    const lead = sign(p[0]);
    [p.length & 1 ? lead : -lead, sign(p[p.length - 1]), lead].forEach((s, k) => s && ends[k].push(s));
    if (!q.length) break;
    // −(p mod q) times a positive number, divided by the factor of the step before (Collins).
    const factor = size(q[0]), toward = q[0] > 0n ? 1n : -1n;
    let rest = p, multiplier = 1n;
    while (rest.length >= q.length) {
      const top = rest[0] * toward;
      rest = rest.slice(1).map((x, i) => x * factor - (i + 1 < q.length ? top * q[i + 1] : 0n));
      multiplier *= factor;
    }
    rest = rest.map((x) => -x / divisor);
    while (rest.length && !rest[0]) rest.shift();
    [p, q, divisor] = [q, rest, multiplier];
  }
  const turns = ends.map((s) => s.reduce((count, x, k) => count + (k && x !== s[k - 1] ? 1 : 0), 0));
  [CHANGES.left, CHANGES.middle, CHANGES.right] = turns;
}

// ---- roots and motion of a design ---------------------------------------------------------------

/**
 * All roots, rightmost first, with exact conjugates next to each other, and the error of the coefficients that they
 * reproduce. `quick` is explained at `factor`.
 */
function rootsOf(a, quick) {
  const n = a.length - 1, re = new Float64Array(n).fill(NaN), im = new Float64Array(n).fill(NaN);
  if (!isRegular(a)) return { re, im, error: NaN };
  factor(a, quick);
  const z = new Float64Array(4), found = [];
  for (let k = 0; k < FOUND.pairs; k++) {
    factorRoots(FOUND.p[k], FOUND.q[k], z);
    found.push([z[0], z[1]], [z[2], z[3]]);
  }
  if (FOUND.odd) found.push([-FOUND.lone, 0]);
  for (let k = 0; k < FOUND.zeros; k++) found.push([0, 0]);
  found.sort((u, v) => v[0] - u[0] || Math.abs(v[1]) - Math.abs(u[1])); // the sort is stable, so conjugates stay together
  found.forEach(([x, y], k) => {
    re[k] = scaledBy(x, FOUND.unit);
    im[k] = scaledBy(y, FOUND.unit);
  });
  return { re, im, error: FOUND.error };
}

/** Real coefficients of the monic polynomial with roots x + i y, which include the conjugates. */
function expanded(x, y) {
  const re = new Float64Array(x.length + 1), im = new Float64Array(x.length + 1);
  re[0] = 1;
  x.forEach((_, k) => {
    for (let i = k + 1; i > 0; i--) {
      re[i] -= x[k] * re[i - 1] - y[k] * im[i - 1];
      im[i] -= x[k] * im[i - 1] + y[k] * re[i - 1];
    }
  });
  return re;
}

/**
 * Roots with im ≥ 0 as [re, im, multiplicity], rightmost first. Roots are joined to groups one after the other, beginning
 * with the nearest. The last groups whose means change no coefficient by more than 1e-11 of its terms become one root
 * each.
 */
function meetingsOf({ re, im }) {
  const n = re.length, all = [...re.keys()], unit = Math.max(...all.map((k) => Math.hypot(re[k], im[k]))) || 1;
  const x = re.map((u) => u / unit), y = im.map((v) => v / unit), size = x.map((u, k) => Math.hypot(u, y[k]));
  const whole = expanded(x, y), terms = expanded(size.map((r) => -r), new Float64Array(n));
  const group = all.slice(), partner = all.map((k) => (im[k] > 0 ? k + 1 : im[k] < 0 ? k - 1 : k));
  const far = (i, j) => Math.hypot(x[i] - x[j], y[i] - y[j]) / (size[i] + size[j] || 1);
  const pairs = all.flatMap((i) => all.slice(i + 1).map((j) => [far(i, j), i, j]));
  pairs.sort((u, v) => u[0] - v[0]);
  const mean = (values, k) => {
    const members = all.filter((i) => group[i] === group[k]);
    return members.reduce((sum, i) => sum + values[i], 0) / members.length;
  };
  let best = group.slice();
  pairs.forEach(([distance, i, j], place) => {
    const [from, into] = [group[j], group[i]];
    all.forEach((k) => (group[k] = group[k] === from ? into : group[k]));
    if (place + 1 < pairs.length && pairs[place + 1][0] <= distance * (1 + 1e-9)) return; // the conjugates must be joined first
    const met = expanded(all.map((k) => mean(x, k)), all.map((k) => mean(y, k)));
    if (met.every((c, k) => Math.abs(c - whole[k]) <= 1e-11 * terms[k])) best = group.slice();
  });
  all.forEach((k) => (group[k] = best[k]));
  const first = all.filter((k) => group.indexOf(group[k]) === k);
  const found = first.map((k) => {
    const real = group[partner[k]] === group[k];
    return [mean(re, k), real ? 0 : mean(im, k), group.filter((g) => g === group[k]).length];
  });
  return found.filter((z) => z[1] >= 0).sort((u, v) => v[0] - u[0] || v[1] - u[1]);
}

/** Write abscissa, damping ratio and angular frequency to `out`; NaN if there are no roots. */
function motionOf(a, out, quick = false) {
  out[0] = out[1] = out[2] = NaN;
  if (!isRegular(a)) return;
  factor(a, quick);
  let abscissa = FOUND.zeros ? 0 : -Infinity, ratio = FOUND.zeros ? 0 : 1, square = 0;
  for (let k = 0; k < FOUND.pairs; k++) {
    const p = FOUND.p[k], q = FOUND.q[k];
    abscissa = Math.max(abscissa, factorAbscissa(p, q));
    ratio = Math.min(ratio, factorDamping(p, q));
    square = Math.max(square, q - 0.25 * p * p);
  }
  if (FOUND.odd) {
    abscissa = Math.max(abscissa, -FOUND.lone);
    if (FOUND.lone < 0) ratio = -1;
  }
  out[0] = scaledBy(abscissa, FOUND.unit);
  out[1] = ratio;
  out[2] = scaledBy(Math.sqrt(square), FOUND.unit);
}

/**
 * Classes of the designs with parameter i from xs and parameter j from ys. A row of the result has one value of ys. With
 * "abscissa" or "damping" in `want`, the result also has these numbers.
 */
function survey(x, i, j, xs, ys, want) {
  const design = Float64Array.from(x), a = new Float64Array(MODEL.degree + 1), out = new Float64Array(3);
  const size = xs.length * ys.length, found = { kind: new Uint8Array(size) };
  const moving = want.includes("abscissa") || want.includes("damping");
  if (moving) {
    found.abscissa = new Float64Array(size);
    found.damping = new Float64Array(size);
  }
  for (let row = 0; row < ys.length; row++) {
    design[j] = ys[row];
    for (let place = 0; place < xs.length; place++) {
      const column = row & 1 ? xs.length - 1 - place : place, k = row * xs.length + column; // back and forth, so that neighbours are near
      design[i] = xs[column];
      MODEL.coefficients(design, a);
      found.kind[k] = kindOf(a);
      if (!moving) continue;
      motionOf(a, out, true);
      found.abscissa[k] = out[0];
      found.damping[k] = out[1];
    }
  }
  return found;
}

// ---- motion over time ---------------------------------------------------------------------------

/** Product of square matrices with n rows, stored row by row. */
function matrixProduct(A, B, n) {
  const C = new Float64Array(n * n);
  for (let i = 0; i < n; i++)
    for (let k = 0; k < n; k++) for (let j = 0; j < n; j++) C[i * n + j] += A[i * n + k] * B[k * n + j];
  return C;
}

/** Exponential of a square matrix A: the Taylor series of 2^-k A, squared k times. */
function exponential(A, n) {
  let norm = 0;
  for (let i = 0; i < n; i++) {
    norm = Math.max(norm, A.subarray(i * n, i * n + n).reduce((sum, x) => sum + Math.abs(x), 0));
  }
  const halvings = norm < Infinity ? Math.max(0, exponentOf(norm) + 3) : 0;
  const part = A.map((x) => scaledBy(x, -halvings));
  let term = Float64Array.from(A, (_, k) => (k % (n + 1) ? 0 : 1)), sum = term.slice();
  for (let k = 1; k <= 14; k++) { // 4^-15/15! is negligible
    term = matrixProduct(term, part, n).map((x) => x / k);
    sum = sum.map((x, i) => x + term[i]);
  }
  for (let k = 0; k < halvings; k++) sum = matrixProduct(sum, sum, n);
  return sum;
}

/** The matrix A of z' = A z from the matrices of a design, or null if the leading matrix is singular. */
function firstOrder(x) {
  const n = MODEL.size, entries = new Float64Array(n * n * (MODEL.order + 1));
  MODEL.pencil(x, entries);
  const width = n * (MODEL.order + 1), rows = [];
  for (let i = 0; i < n; i++) {
    // M | K, D, or I | A; the unknowns are in the order of the state.
    const row = new Float64Array(width);
    for (let j = 0; j < n; j++) {
      row[j] = entries[i * n + j];
      for (let k = 1; k <= MODEL.order; k++) row[(MODEL.order + 1 - k) * n + j] = -entries[(k * n + i) * n + j];
    }
    const size = exponentOf(Math.max(...row.subarray(0, n).map(Math.abs)));
    rows.push(row.map((x) => scaledBy(x, -size))); // a mass may be tiny compared with another
  }
  for (let c = 0; c < n; c++) {
    const best = rows.slice(c).reduce((most, row, k) => (Math.abs(row[c]) > Math.abs(rows[most][c]) ? c + k : most), c);
    if (!(Math.abs(rows[best][c]) > 1e-14)) return null;
    [rows[c], rows[best]] = [rows[best], rows[c]];
    for (let i = 0; i < n; i++) {
      if (i === c) continue;
      const share = rows[i][c] / rows[c][c];
      for (let k = c; k < width; k++) rows[i][k] -= share * rows[c][k];
    }
  }
  const states = n * MODEL.order, A = new Float64Array(states * states);
  for (let i = 0; i < states - n; i++) A[i * states + n + i] = 1;
  for (let i = 0; i < n; i++)
    for (let k = 0; k < states; k++) A[(states - n + i) * states + k] = rows[i][n + k] / rows[i][i];
  return A.every(Number.isFinite) ? A : null;
}

/** The n states of z' = A z at ascending times, from a start at time 0. */
function flow(A, n, start, times) {
  const found = new Float64Array(times.length * n);
  let state = Float64Array.from(start), time = 0, step = NaN, over = null;
  for (let k = 0; k < times.length; k++) {
    const next = times[k] - time;
    if (!(Math.abs(next - step) <= 1e-15 * Math.abs(times[k]))) {
      over = exponential(A.map((e) => e * next), n);
      step = next;
    }
    time = times[k];
    for (let i = 0; i < n; i++) {
      let sum = 0;
      for (let j = 0; j < n; j++) sum += over[i * n + j] * state[j];
      found[k * n + i] = sum;
    }
    state = found.subarray(k * n, k * n + n);
  }
  return found;
}

/** The motion of the model's matrices, displacements and then velocities; null if there is no `firstOrder`. */
function response(x, start, times) {
  const A = MODEL.pencil && firstOrder(x);
  return A ? flow(A, MODEL.size * MODEL.order, start, times) : null;
}
