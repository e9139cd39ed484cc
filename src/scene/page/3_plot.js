/* A plot over time on a canvas, with a cursor at the time shown; dragging in the plot changes the time. */

const seriesColours = ['#1f6feb', '#d9730d', '#2a9d5c'];

class Plot {
  /* series: [{name, value: array over the frames}]; scrub(t) is called when the cursor is moved */
  constructor(time, title, unit, series, scrub) {
    Object.assign(this, {time, title, unit, series});
    this.element = document.createElement('figure');
    this.element.className = 'plot';
    this.element.innerHTML = '<figcaption><span class="name"></span><span class="value"></span></figcaption><div class="key"></div><canvas role="img"></canvas>';
    this.element.querySelector('.name').textContent = title;
    this.canvas = this.element.querySelector('canvas');
    this.picture = document.createElement('canvas');
    this.canvas.setAttribute('aria-label', title + ' over time' + (unit ? ' in ' + unit : ''));
    this.measure();
    const move = e => {
      const box = this.canvas.getBoundingClientRect(), [t0, t1] = this.timeRange();
      scrub(t0 + (t1 - t0) * Math.min(1, Math.max(0, (e.clientX - box.left - this.left) / (box.width - this.left - this.right))));
    };
    this.canvas.addEventListener('pointerdown', e => { this.canvas.setPointerCapture(e.pointerId); move(e); });
    this.canvas.addEventListener('pointermove', e => { if (e.buttons) move(e); });
  }

  timeRange() { return [this.time[0], this.time[this.time.length - 1]]; }

  /* Sets the range of the vertical axis, a little wider than that of the values */
  measure() {
    let low = Infinity, high = -Infinity;
    for (const s of this.series)
      for (const x of s.value)
        if (Number.isFinite(x)) {
          if (x < low) low = x;
          if (x > high) high = x;
        }
    if (low > high) [low, high] = [0, 1];
    const size = Math.max(Math.abs(low), Math.abs(high)), margin = high - low > 1e-6 * size ? 0.06 * (high - low) : 0.1 * size || 1;
    this.low = low - margin;
    this.high = high + margin;
  }

  valueAt(s, k, part) { return part ? s.value[k] * (1 - part) + s.value[k + 1] * part : s.value[k]; }

  draw(t, place) {
    const ratio = window.devicePixelRatio || 1, width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    if (!width || !height) return;
    const key = [width, height, ratio, document.documentElement.dataset.theme].join();
    if (this.drawn !== key) this.drawCurves(width, height, ratio);
    this.drawn = key;
    const g = this.canvas.getContext('2d');
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.clearRect(0, 0, this.canvas.width, this.canvas.height);
    g.drawImage(this.picture, 0, 0);
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawCursor(g, t, place);
  }

  /* Draws everything except the cursor on a separate canvas, which is reused: drawing curves with many samples takes longer than everything else */
  drawCurves(width, height, ratio) {
    for (const canvas of [this.canvas, this.picture]) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const g = this.picture.getContext('2d'), style = getComputedStyle(document.documentElement), colour = name => style.getPropertyValue(name).trim();
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.font = '11px system-ui, "Liberation Sans", sans-serif';
    const marks = ticks(this.low, this.high, 4), labels = tickLabels(marks, this.high - this.low);
    this.left = 8 + Math.max(...labels.map(l => g.measureText(l).width));
    this.right = 8;
    this.ink = colour('--ink');
    this.top = 6;
    this.bottom = height - 18;
    const [t0, t1] = this.timeRange(), long = width - this.left - this.right, tall = this.bottom - this.top;
    const x = this.x = time => this.left + long * (t1 > t0 ? (time - t0) / (t1 - t0) : 0.5);
    const y = this.y = value => this.top + tall * (this.high - value) / (this.high - this.low);
    g.lineWidth = 1;
    g.strokeStyle = colour('--rule');
    g.fillStyle = colour('--faint');
    g.textAlign = 'right';
    g.textBaseline = 'middle';
    marks.forEach((m, i) => {
      g.beginPath();
      g.moveTo(this.left, Math.round(y(m)) + 0.5);
      g.lineTo(width - this.right, Math.round(y(m)) + 0.5);
      g.stroke();
      g.fillText(labels[i], this.left - 4, y(m));
    });
    g.textBaseline = 'alphabetic';
    const times = ticks(t0, t1, Math.max(2, Math.floor(width / 90)));
    g.textAlign = 'center';
    tickLabels(times, t1 - t0).forEach((label, i) => {
      const half = g.measureText(label).width / 2;
      g.fillText(label, Math.min(width - half - 1, Math.max(half, x(times[i]))), height - 4);
    });
    this.series.forEach((s, i) => {
      g.strokeStyle = seriesColours[i % seriesColours.length];
      g.lineWidth = 1.4;
      g.beginPath();
      let down = false;
      for (const k of this.visible(s.value, ratio)) {
        const on = Number.isFinite(s.value[k]);
        if (on) g[down ? 'lineTo' : 'moveTo'](x(this.time[k]), y(s.value[k]));
        down = on;
      }
      g.stroke();
    });
  }

  /* The samples through which the curve is drawn: in each column of pixels the first, the lowest, the highest and the last one */
  visible(value, ratio) {
    const column = k => Number.isFinite(value[k]) ? Math.floor(ratio * this.x(this.time[k])) : NaN, list = [];
    for (let k = 0; k < value.length;) {
      const first = k, here = column(k);
      let low = k, high = k;
      while (column(++k) === here) {
        if (value[k] < value[low]) low = k;
        if (value[k] > value[high]) high = k;
      }
      list.push(...new Set([first, Math.min(low, high), Math.max(low, high), k - 1]));
    }
    return list;
  }

  drawCursor(g, t, [k, part]) {
    const x = this.x(t);
    g.strokeStyle = this.ink;
    g.lineWidth = 1;
    g.beginPath();
    g.moveTo(x, this.top);
    g.lineTo(x, this.bottom);
    g.stroke();
    const now = this.series.map(s => this.valueAt(s, k, part));
    now.forEach((v, i) => {
      if (!Number.isFinite(v)) return;
      g.fillStyle = seriesColours[i % seriesColours.length];
      g.beginPath();
      g.arc(x, this.y(v), 3, 0, 2 * Math.PI);
      g.fill();
    });
    const value = this.element.querySelector('.value'), key = this.element.querySelector('.key');
    const digits = digitsFor(Math.max(Math.abs(this.low), Math.abs(this.high)), (this.high - this.low) / 100);
    if (this.series.length === 1) value.textContent = formatWithUnit(now[0], this.unit, digits);
    else {
      value.textContent = this.unit;
      while (key.children.length < now.length) key.append(document.createElement('span'));
      now.forEach((v, i) => {
        key.children[i].textContent = this.series[i].name + ' ' + formatNumber(v, digits);
        key.children[i].style.color = seriesColours[i % seriesColours.length];
      });
    }
  }
}
