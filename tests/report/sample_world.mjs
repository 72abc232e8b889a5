// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// A made-up street, walked in laps: where the camera is, and what it sees. Posts stand along it;
// seen from the same place they are in the same columns, so contents, pictures and inliers agree.
import { deflateSync } from "node:zlib";

const kLap_m = 120;
const kSide = 64;
const kView_m = 40;
const kWidth_px = 192;
const kHeight_px = 128;

/** Numbers from 0 to 1, the same for the same seed. */
export function random(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 4294967296;
  };
}

const posts = (() => {
  const next = random(7);
  return Array.from({ length: 150 }, (_, i) => ({
    along_m: (i * kLap_m) / 150 + next(),
    aside_m: (next() < 0.5 ? -1 : 1) * (2 + 5 * next()),
    height_m: 1.5 + 4 * next(),
    width_m: 0.4 + 0.9 * next(),
    grey: 40 + Math.floor(150 * next()),
  }));
})();

/** The street from above: a rectangle of 40 x 20 m with round corners. */
export function positionAt({ along_m, aside_m }) {
  const turn = ((along_m % kLap_m) / kLap_m) * 2 * Math.PI;
  const round = (x) => Math.sign(x) * Math.abs(x) ** 0.6;
  return { x: (22 + aside_m) * round(Math.cos(turn)), y: (13 + aside_m) * round(Math.sin(turn)) };
}

/** Distance along the street between two places, whatever the lap. */
export function distance_m(a_m, b_m) {
  const apart = Math.abs(a_m - b_m) % kLap_m;
  return Math.min(apart, kLap_m - apart);
}

export const lap_m = kLap_m;

/** Makes something of an object once, and keeps it as long as the object. */
const onceEach = (make) => {
  const made = new WeakMap();
  return (of) => {
    if (!made.has(of)) made.set(of, make(of));
    return made.get(of);
  };
};

/** The posts in view, the farthest first; x from 0 to 1 is left to right. */
const seenFrom = onceEach(({ along_m, aside_m }) => {
  const seen = [];
  for (const [id, post] of posts.entries()) {
    const ahead_m = (post.along_m - along_m + 10 * kLap_m) % kLap_m;
    if (ahead_m <= 3 || ahead_m >= kView_m) continue;
    const x = 0.5 + (0.7 * (post.aside_m - aside_m)) / ahead_m;
    if (x <= 0 || x >= 1) continue;
    const width = post.width_m / ahead_m;
    const top = 0.5 - (0.8 * (post.height_m - 1.5)) / ahead_m;
    seen.push({ id, grey: post.grey, x, width, top, bottom: 0.5 + 1.2 / ahead_m, ahead_m });
  }
  return seen.sort((a, b) => b.ahead_m - a.ahead_m);
});

function chunk(type, data) {
  const body = Buffer.concat([Buffer.from(type, "latin1"), data]);
  const out = Buffer.alloc(body.length + 8);
  out.writeUInt32BE(data.length, 0);
  body.copy(out, 4);
  out.writeUInt32BE(crc32(body), body.length + 4);
  return out;
}

const crcTable = Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let k = 0; k < 8; ++k) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c >>> 0;
});

function crc32(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) crc = crcTable[(crc ^ byte) & 255] ^ (crc >>> 8);
  return (crc ^ 0xffffffff) >>> 0;
}

/** An 8-bit grey PNG, base64. */
export function pngOf(grey, width, height) {
  const header = Buffer.alloc(13);
  header.writeUInt32BE(width, 0);
  header.writeUInt32BE(height, 4);
  header.set([8, 0, 0, 0, 0], 8);
  const rows = Buffer.alloc((width + 1) * height);
  for (let y = 0; y < height; ++y)
    rows.set(grey.subarray(y * width, (y + 1) * width), y * (width + 1) + 1);
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  const parts = [
    chunk("IHDR", header),
    chunk("IDAT", deflateSync(rows)),
    chunk("IEND", Buffer.alloc(0)),
  ];
  return Buffer.concat([signature, ...parts]).toString("base64");
}

function fillPosts(pixels, width, height, seen, value) {
  for (const post of seen) {
    const left = Math.max(0, Math.round((post.x - post.width / 2) * width));
    const right = Math.min(
      width,
      Math.max(left + 1, Math.round((post.x + post.width / 2) * width)),
    );
    const top = Math.max(0, Math.round(post.top * height));
    const bottom = Math.min(height, Math.round(post.bottom * height));
    for (let y = top; y < bottom; ++y)
      pixels.fill(value(post), y * width + left, y * width + right);
  }
}

function pictureOf(seen) {
  const pixels = new Uint8Array(kWidth_px * kHeight_px);
  for (let y = 0; y < kHeight_px; ++y) {
    const isSky = y < kHeight_px / 2;
    pixels.fill(
      isSky ? 232 - y / 3 : 130 + (y - kHeight_px / 2) / 2,
      y * kWidth_px,
      (y + 1) * kWidth_px,
    );
  }
  fillPosts(
    pixels,
    kWidth_px,
    kHeight_px,
    seen,
    ({ grey, ahead_m }) => grey + (2 * (200 - grey) * ahead_m) / 100,
  );
  return pngOf(pixels, kWidth_px, kHeight_px);
}

/** The content as 4096 bytes of 0 or 1: the edges of the posts. */
export function contentAt(place) {
  const bits = new Uint8Array(kSide * kSide);
  const near = seenFrom(place).filter(({ ahead_m }) => ahead_m < 24);
  fillPosts(bits, kSide, kSide, near, ({ id }) => (id % 3 === 0 ? 0 : 1));
  return bits;
}

function packed(bits) {
  const bytes = Buffer.alloc(bits.length / 8);
  for (const [i, bit] of bits.entries()) bytes[i >> 3] |= bit << (i & 7);
  return bytes.toString("base64");
}

function saliencyOf(bits) {
  const blurred = new Uint8Array(bits.length);
  for (let i = 0; i < bits.length; ++i) {
    let sum = 0;
    for (let dy = -2; dy <= 2; ++dy) {
      for (let dx = -2; dx <= 2; ++dx) sum += bits[i + dy * kSide + dx] ?? 0;
    }
    blurred[i] = sum * 10;
  }
  return pngOf(blurred, kSide, kSide);
}

/** Corners of the posts that both places see. */
function inliersOf(place, other) {
  const seen = new Map(seenFrom(other).map((post) => [post.id, post]));
  const numbers = seenFrom(place).flatMap((post) => {
    const same = seen.get(post.id);
    return same
      ? [post.x, post.top, same.x, same.top, post.x, post.bottom, same.x, same.bottom]
      : [];
  });
  return Buffer.from(Float32Array.from(numbers.map((x) => Math.min(1, Math.max(0, x)))).buffer);
}

const viewOf = onceEach((place) => {
  const content = contentAt(place);
  return {
    jpeg: pictureOf(seenFrom(place)),
    saliency: saliencyOf(content),
    content: packed(content),
  };
});

/** As the report has it; PNG stands in for JPEG, which browsers tell apart by content. */
export function evidenceAt(place, other) {
  return {
    ...viewOf(place),
    inliers: other ? inliersOf(place, other).toString("base64") : null,
  };
}

/** Of a content, the columns of the ones of each row. */
const columnsOf = onceEach((bits) => {
  const rows = [];
  let count = 0;
  for (let y = 0; y < kSide; ++y) {
    const row = [];
    for (let x = 0; x < kSide; ++x) if (bits[y * kSide + x] === 1) row.push(x);
    rows.push(row);
    count += row.length;
  }
  return { rows, count };
});

/** xi with an even shift tolerance, one by one: the plain meaning of the equation. */
export function similarity(a, b, tolerance) {
  const { rows, count } = columnsOf(a);
  const larger = Math.max(count, columnsOf(b).count);
  let best = 0;
  for (let shift = -tolerance; shift <= tolerance; shift += 2) {
    let both = 0;
    for (let y = 0; y < kSide; ++y) {
      for (const x of rows[y]) {
        const shifted = x + shift;
        if (shifted >= 0 && shifted < kSide) both += b[y * kSide + shifted];
      }
    }
    best = Math.max(best, both);
  }
  return larger === 0 ? 0 : best / larger;
}
