// What comes over the scene stream (README.md, "Scene stream"), turned into plain values. Unknown kinds give null. Pure. The messages' layout
// is that of stream/scene_stream.idl, from which scene-wire is made.
import {Body, Hand, Mark, Paint, Patch, Poses} from 'scene-wire';

export const kViewBits = {main: 1, hit: 2, tool: 4};
export const kShapes = [null, 'cone', 'cylinder', 'sphere', 'disc'];

// Returns the message of where the controller is that leads the arm: `position_m` and `turn` (x, y, z, w) in the axes of W.
export function encodeHand(hand) {
  const data = new DataView(new ArrayBuffer(Hand.bytes));
  Hand.write(data, 0, hand);
  return data.buffer;
}

// Returns a quaternion with length 1; one of noughts as it is.
function unit(turn) {
  const length = Math.hypot(...turn) || 1;
  return turn.map(part => part / length);
}
// Reads `count` of a type that stand one after the other.
const all = (type, data, at, count) => Array.from({length: count}, (_, i) => type.read(data, at + i * type.bytes));

function poses(data) {
  const {bodyCount, markCount, ...head} = Poses.read(data);
  const bodies = all(Body, data, Poses.bytes, bodyCount).map(({origin_m, turn}) => ({origin_m, turn: unit(turn)}));
  const marks = all(Mark, data, Poses.bytes + bodyCount * Body.bytes, markCount).map(({shape, turn, ...mark}) => ({
    ...mark,
    shape: kShapes[shape] ?? null,
    turn: unit(turn),
  }));
  return {kind: 'poses', ...head, bodies, marks};
}

function paint(data) {
  const {count, unit_m, ...head} = Paint.read(data);
  const patches = all(Patch, data, Paint.bytes, count).map(({middle, ...patch}) => ({
    ...patch,
    middle_m: middle.map(part => part * unit_m),
  }));
  return {kind: 'paint', ...head, patches};
}

// Returns a binary message's content; null if its kind is not known or it is damaged.
export function decode(buffer) {
  const data = new DataView(buffer);
  try {
    const kind = data.getUint8(0);
    return kind === Poses.kind ? poses(data) : kind === Paint.kind ? paint(data) : null;
  } catch (problem) {
    if (problem instanceof RangeError) return null;
    throw problem;
  }
}

// Returns the vertices and triangles of GET /mesh/…; throws RangeError if they are not whole or name vertices that are not there.
export function decodeMesh(buffer) {
  const data = new DataView(buffer),
    vertexCount = data.getUint32(0, true),
    triangleCount = data.getUint32(4, true);
  const vertices_m = new Float32Array(buffer, 8, 3 * vertexCount);
  const corners = new Uint32Array(buffer, 8 + 12 * vertexCount, 3 * triangleCount);
  for (const corner of corners)
    if (corner >= vertexCount) throw new RangeError('a triangle names a vertex that is not there');
  return {vertices_m, corners};
}
