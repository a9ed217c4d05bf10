// SPDX-License-Identifier: Apache-2.0
// Series as the page holds them (packing.hpp), and what a chart shows of them.
"use strict";
const series = (() => {
  const gap = 0xffff;  // no value
  const block = 64;    // codes in one entry of a summary

  const bytesOf = (text) => {
    if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
    const raw = atob(text), out = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; ++i) out[i] = raw.charCodeAt(i);
    return out;
  };

  const inflate = async (text) => {
    const stream = new DecompressionStream("deflate"), writer = stream.writable.getWriter();
    const all = new Response(stream.readable).arrayBuffer();
    await Promise.all([writer.write(bytesOf(text)), writer.close(), all]);
    return new Uint8Array(await all);
  };

  const codesOf = (planes, order) => {
    const n = planes.length / 2, codes = new Uint16Array(n);
    let code = 0, slope = 0;
    for (let i = 0; i < n; ++i) {
      const z = planes[i] | planes[n + i] << 8, d = z >>> 1 ^ -(z & 1);
      if (order === 2) slope = slope + d & gap;
      code = (order === 0 ? d : code + (order === 1 ? d : slope)) & gap;
      codes[i] = code;
    }
    return codes;
  };

  // Smallest and largest code of [a, b), as two entries of `out`; gap and −1 where there are none.
  const scan = (codes, a, b, out) => {
    let low = gap, high = -1;
    for (let i = a; i < b; ++i) {
      const c = codes[i];
      if (c < low) low = c;
      if (c > high && c !== gap) high = c;
    }
    if (low < out[0]) out[0] = low;
    if (high > out[1]) out[1] = high;
  };

  // A series: head is {low, step, order}.
  const unpack = async (head, text) => {
    const codes = codesOf(await inflate(text), head.order);
    const count = Math.ceil(codes.length / block), lows = new Uint16Array(count), highs = new Int32Array(count);
    const found = [0, 0];
    for (let k = 0; k < count; ++k) {
      found[0] = gap, found[1] = -1;
      scan(codes, k * block, Math.min(codes.length, (k + 1) * block), found);
      lows[k] = found[0], highs[k] = found[1];
    }
    return {codes, lows, highs, low: head.low, step: head.step};
  };

  // Times, and the indices at which segments start: head is {start, tick, jumps}.
  const unpackTimes = async (head, text) => {
    const planes = await inflate(text), n = planes.length / 4, t = new Float64Array(n);
    let k = 0, step = 0, jump = 0;
    for (let i = 0; i < n; ++i) {
      const z = (planes[i] | planes[n + i] << 8 | planes[2 * n + i] << 16 | planes[3 * n + i] << 24) >>> 0;
      step += z % 2 ? -(z + 1) / 2 : z / 2;
      if (jump < head.jumps.length && head.jumps[jump][0] === i) k = head.jumps[jump++][1];
      else k += step;
      t[i] = head.start + k * head.tick;
    }
    return {t, breaks: head.jumps.slice(1).map((j) => j[0])};
  };

  const value = (line, code) => code === gap || code < 0 ? null : line.low + line.step * code;

  // First index in [0, n] whose time is not below x.
  const lowerBound = (t, x) => {
    let a = 0, b = t.length;
    while (a < b) {
      const middle = a + b >> 1;
      if (t[middle] < x) a = middle + 1; else b = middle;
    }
    return a;
  };

  const extremes = (line, a, b) => {
    const out = [gap, -1], first = Math.ceil(a / block), last = Math.floor(b / block);
    if (first >= last) {
      scan(line.codes, a, b, out);
    } else {
      scan(line.codes, a, first * block, out);
      for (let k = first; k < last; ++k) {
        if (line.lows[k] < out[0]) out[0] = line.lows[k];
        if (line.highs[k] > out[1]) out[1] = line.highs[k];
      }
      scan(line.codes, last * block, b, out);
    }
    return out;
  };

  // The rows of uPlot for the times [from, to] and a sample beyond each: every sample where these are `most` or fewer, else
  // the smallest and the largest of each of at most `most` equal bins. Nothing joins segments that are seen to be apart.
  const view = ({t, breaks}, lines, from, to, most) => {
    const begin = Math.max(0, lowerBound(t, from) - 1), end = Math.min(t.length, lowerBound(t, to) + 2);
    let width = 1;
    while ((end - begin) / width > most - 1) width *= 2;
    const cuts = [];
    for (let k = lowerBound(breaks, begin + 1); k < breaks.length && breaks[k] < end; ++k) {
      if (width === 1 || t[breaks[k]] - t[breaks[k] - 1] > (to - from) / most) cuts.push(breaks[k]);
    }
    const x = [], ys = lines.map(() => []);
    let cut = 0;
    for (let a = begin, b; a < end; a = b) {
      b = Math.min(end, a - a % width + width);
      if (cuts[cut] === a) {
        x.push(0.5 * (t[a - 1] + t[a]));
        ys.forEach((y) => y.push(null));
        ++cut;
      }
      if (cuts[cut] < b) b = cuts[cut];
      x.push(t[a]);
      if (b - a === 1) {
        lines.forEach((line, i) => ys[i].push(value(line, line.codes[a])));
      } else {
        x.push(t[a + (b - a >> 1)]);
        lines.forEach((line, i) => {
          const [low, high] = extremes(line, a, b);
          ys[i].push(value(line, low), value(line, high));
        });
      }
    }
    return {data: [x, ...ys], whole: width === 1};
  };

  return {unpack, unpackTimes, value, view};
})();
