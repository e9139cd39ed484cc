/* Formats numbers for display. */

const superscript = n => String(n).replace(/[-0-9]/g, c => c === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[c]);

function formatNumber(x, digits = 4) {
  if (!Number.isFinite(x)) return '–';
  if (x === 0) return '0';
  const size = Math.abs(x);
  if (size < 1e-3 || size >= 1e5) {
    const [m, e] = x.toExponential(digits - 1).split('e');
    return m.replace(/\.?0+$/, '').replace('-', '−') + '·10' + superscript(Number(e));
  }
  return String(Number(x.toPrecision(digits))).replace('-', '−');
}

/* A number with its unit, and with a prefix if the unit may have one: "123 MPa" */
function formatWithUnit(x, unit, digits = 4) {
  if (/^(Pa|N|W|J|Hz)$/.test(unit) && Math.abs(x) >= 1e3) {
    const power = Math.min(4, Math.floor(Math.log10(Math.abs(x)) / 3));
    return formatNumber(x / 10 ** (3 * power), digits) + ' ' + ' kMGT'[power] + unit;
  }
  return formatNumber(x, digits) + (unit ? ' ' + unit : '');
}

/* A round step, 1, 2 or 5 times a power of ten, that divides a range into about `count` intervals */
function roundStep(range, count) {
  const rough = range / count, power = 10 ** Math.floor(Math.log10(rough));
  for (const m of [1, 2, 5, 10]) if (m * power >= rough) return m * power;
}

/* The number of digits that distinguishes numbers of magnitude up to `size` that differ by `step` */
function digitsFor(size, step) {
  return step > 0 && size > 0 ? Math.min(15, Math.max(4, 1 + Math.floor(Math.log10(size) + 1e-9) - Math.floor(Math.log10(step) + 1e-9))) : 4;
}

/* Times of magnitude up to `size`, with the digits that distinguish times that differ by `step`; times of a short run
   have a common power of ten: "0.70 / 1.00 · 10⁻⁶" */
function formatTimes(times, size, step) {
  const power = size > 0 && size < 1e-3 ? Math.floor(Math.log10(size)) : 0, digits = Math.min(12, Math.max(0, power - Math.floor(Math.log10(step))));
  return times.map(t => (t / 10 ** power).toFixed(digits)).join(' / ') + (power ? ' · 10' + superscript(power) : '');
}

function tickLabels(list, range) {
  const digits = digitsFor(Math.max(...list.map(Math.abs)), list[1] - list[0]);
  return list.map(x => formatNumber(Math.abs(x) < 1e-9 * range ? 0 : x, digits));
}

function ticks(low, high, count) {
  const step = roundStep(high - low, count), list = [];
  if (!(step > 0)) return [low];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) list.push(k * step);
  return list;
}
