// What comes over the scene stream (README.md, "Scene stream"), turned into plain values. Unknown kinds give null. Pure.

export const kViewBits = { main: 1, hit: 2, tool: 4 };
export const kShapes = [null, 'cone', 'cylinder', 'sphere', 'disc'];
const kHeader = 36, kBody = 20, kMark = 44, kPaintHeader = 16, kPatch = 8;

const kHandOctets = 44;

// Returns the message of where the controller is that leads the arm: `position_m` and `turn` (x, y, z, w) in the axes of W.
export function encodeHand({ number, time_s, tracked, grip, trigger, position_m, turn }) {
  const data = new DataView(new ArrayBuffer(kHandOctets));
  data.setUint8(0, 3);
  data.setUint8(1, (tracked ? 1 : 0) | (grip ? 2 : 0));
  data.setUint16(2, Math.round(65535 * trigger), true);
  data.setUint32(4, number, true);
  data.setFloat64(8, time_s, true);
  [...position_m, ...turn].forEach((value, i) => data.setFloat32(16 + 4 * i, value, true));
  return data.buffer;
}

// Reads a unit quaternion x, y, z, w of four i16.
function quaternion(data, at) {
  const q = [0, 2, 4, 6].map(i => data.getInt16(at + i, true));
  const length = Math.hypot(...q) || 1;
  return q.map(part => part / length);
}
const vector = (data, at) => [data.getFloat32(at, true), data.getFloat32(at + 4, true), data.getFloat32(at + 8, true)];

// Throws RangeError if the message is shorter than it says.
function poses(data) {
  const bodies = [], marks = [];
  const bodyCount = data.getUint8(2), markCount = data.getUint8(3), flags = data.getUint8(1);
  for (let i = 0, at = kHeader; i < bodyCount; ++i, at += kBody) bodies.push({ origin_m: vector(data, at), turn: quaternion(data, at + 12) });
  for (let i = 0, at = kHeader + bodyCount * kBody; i < markCount; ++i, at += kMark) {
    const part = k => data.getUint16(at + 36 + 2 * k, true) / 65535;
    marks.push({
      shape: kShapes[data.getUint8(at)] ?? null, views: data.getUint8(at + 1), ownLight: data.getUint8(at + 2) / 255, origin_m: vector(data, at + 4),
      turn: quaternion(data, at + 16), scale: vector(data, at + 24), colour: [part(0), part(1), part(2)], opacity: part(3),
    });
  }
  return {
    kind: 'poses', heard: (flags & 1) !== 0, stale: (flags & 2) !== 0, perceptKnown: (flags & 4) !== 0, painted: (flags & 8) !== 0,
    number: data.getUint32(4, true), time_s: data.getFloat64(8, true), armAge_s: data.getFloat32(16, true), perceptAge_s: data.getFloat32(20, true),
    toolFree: data.getFloat32(24, true), closeness: data.getFloat32(28, true), speed_m_s: data.getFloat32(32, true), bodies, marks,
  };
}

function paint(data) {
  const patches = [], count = data.getUint16(2, true), unit_m = data.getFloat32(12, true);
  for (let i = 0, at = kPaintHeader; i < count; ++i, at += kPatch) {
    patches.push({ link: data.getUint8(at), closeness: data.getUint8(at + 1) / 255, middle_m: [2, 4, 6].map(k => data.getInt16(at + k, true) * unit_m) });
  }
  return { kind: 'paint', number: data.getUint32(4, true), patch_m: data.getFloat32(8, true), patches };
}

// Returns a binary message's content; null if its kind is not known or it is damaged.
export function decode(buffer) {
  const data = new DataView(buffer);
  try {
    const kind = data.getUint8(0);
    return kind === 1 ? poses(data) : kind === 2 ? paint(data) : null;
  } catch (problem) {
    if (problem instanceof RangeError) return null;
    throw problem;
  }
}

// Returns the vertices and triangles of GET /mesh/…; throws RangeError if they are not whole or name vertices that are not there.
export function decodeMesh(buffer) {
  const data = new DataView(buffer), vertexCount = data.getUint32(0, true), triangleCount = data.getUint32(4, true);
  const vertices_m = new Float32Array(buffer, 8, 3 * vertexCount);
  const corners = new Uint32Array(buffer, 8 + 12 * vertexCount, 3 * triangleCount);
  for (const corner of corners) if (corner >= vertexCount) throw new RangeError('a triangle names a vertex that is not there');
  return { vertices_m, corners };
}
