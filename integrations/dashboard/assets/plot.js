// A line plot on a canvas: redrawn at 10 Hz, whatever the rate of the messages.

export const COLOURS = ["--blue", "--amber", "--green", "--red"];

// Steps of 1, 2 or 5 times a power of ten, about `count` of them.
function ticks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough);
  const all = [];
  for (let tick = Math.ceil(low / step) * step; tick <= high + step * 1e-6 && all.length < 50; tick += step) all.push(Math.abs(tick) < step * 1e-6 ? 0 : tick);
  return { all, digits: Math.max(0, Math.min(12, -Math.floor(Math.log10(step)))) };
}

export class Plot {
  constructor(canvas, names) {
    this.canvas = canvas;
    this.names = names;
    this.points = [];
    this.drawn = 0;
  }

  // `values` has a number or null for each name.
  add(time, values, span) {
    const last = this.points.at(-1);
    if (last && time < last.time) this.points = [];
    if (last && time === last.time) return;
    this.points.push({ time, values });
    const from = this.points.findIndex((point) => point.time >= time - span * 1.1);
    if (from > 0) this.points.splice(0, from);
  }

  draw(span) {
    const { canvas } = this, ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const style = getComputedStyle(canvas), colour = (name) => style.getPropertyValue(name).trim();
    const draw = canvas.getContext("2d");
    draw.setTransform(ratio, 0, 0, ratio, 0, 0);
    draw.clearRect(0, 0, width, height);
    draw.font = `12px ${style.fontFamily}`;
    draw.textBaseline = "middle";
    const end = this.points.at(-1)?.time ?? 0, start = end - span;
    const shown = this.points.filter((point) => point.time >= start);
    let low = Infinity, high = -Infinity;
    for (const { values } of shown) for (const value of values) if (Number.isFinite(value)) { low = Math.min(low, value); high = Math.max(high, value); }
    if (low > high) {
      draw.fillStyle = colour("--soft");
      draw.fillText("no message yet", 8, height / 2);
      return;
    }
    const least = Math.max(Math.abs(low), Math.abs(high), 1e-9) * 1e-3;
    if (high - low < least) { low -= least; high += least; }
    const margin = (high - low) * 0.08;
    low -= margin;
    high += margin;
    const scale = ticks(low, high, Math.max(2, Math.floor(height / 45)));
    const labels = scale.all.map((tick) => tick.toFixed(scale.digits));
    const left = Math.max(...labels.map((label) => draw.measureText(label).width)) + 12, bottom = 22, right = 8, top = 6;
    const x = (time) => left + (time - start) / span * (width - left - right);
    const y = (value) => height - bottom - (value - low) / (high - low) * (height - bottom - top);
    draw.lineWidth = 1;
    draw.strokeStyle = colour("--line");
    draw.fillStyle = colour("--soft");
    scale.all.forEach((tick, index) => {
      const at = Math.round(y(tick)) + 0.5;
      draw.beginPath(); draw.moveTo(left, at); draw.lineTo(width - right, at); draw.stroke();
      draw.textAlign = "right";
      draw.fillText(labels[index], left - 8, at);
    });
    draw.textAlign = "center";
    for (const tick of ticks(-span, 0, Math.max(2, Math.floor(width / 140))).all) {
      const at = Math.min(Math.max(x(end + tick), left + 14), width - right - 12);
      draw.fillText(tick === 0 ? "now" : `${tick} s`, at, height - bottom / 2);
    }
    draw.save();
    draw.beginPath(); draw.rect(left, 0, width - left - right, height - bottom); draw.clip();
    this.names.forEach((_, index) => {
      draw.strokeStyle = colour(COLOURS[index % COLOURS.length]);
      draw.lineWidth = 1.75;
      draw.beginPath();
      let before = null;
      for (const { time, values } of shown) {
        const value = values[index];
        // A gap of more than a second is a gap.
        if (!Number.isFinite(value)) { before = null; continue; }
        if (before === null || time - before > 1) draw.moveTo(x(time), y(value)); else draw.lineTo(x(time), y(value));
        before = time;
      }
      draw.stroke();
    });
    draw.restore();
    this.drawn += 1;
  }
}
