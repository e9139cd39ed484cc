/* Numbers as people read them. */

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

/* With a prefix where the unit takes one: "123 MPa" */
function formatWithUnit(x, unit, digits = 4) {
  if (/^(Pa|N|W|J|Hz)$/.test(unit) && Math.abs(x) >= 1e3) {
    const power = Math.min(4, Math.floor(Math.log10(Math.abs(x)) / 3));
    return formatNumber(x / 10 ** (3 * power), digits) + ' ' + ' kMGT'[power] + unit;
  }
  return formatNumber(x, digits) + (unit ? ' ' + unit : '');
}

/* Round distances for about `count` intervals: 1, 2 or 5 times a power of ten */
function roundStep(range, count) {
  const rough = range / count, power = 10 ** Math.floor(Math.log10(rough));
  for (const m of [1, 2, 5, 10]) if (m * power >= rough) return m * power;
}

/* As many digits as tell numbers up to `size` apart by `step` */
function digitsFor(size, step) {
  return step > 0 && size > 0 ? Math.min(15, Math.max(4, 1 + Math.floor(Math.log10(size) + 1e-9) - Math.floor(Math.log10(step) + 1e-9))) : 4;
}

/* Times up to `size` that are told apart by `step`; those of a short run in a power of ten that they share: "0.70 / 1.00 · 10⁻⁶" */
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
