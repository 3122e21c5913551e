// The shapes of marks (frame.hpp): of unit length and radius; cone and cylinder from z = 0 to 1, the cone with its tip at 1; sphere and
// disc round the origin, the disc in z = 0, seen from both sides.

import {ConeGeometry, CylinderGeometry, SphereGeometry} from 'three';

const kSides = 32,
  kRings = 20,
  kDiscHeight = 1e-4;
const kMakers = {
  cone: () => new ConeGeometry(1, 1, kSides).rotateX(Math.PI / 2).translate(0, 0, 0.5),
  cylinder: () => new CylinderGeometry(1, 1, 1, kSides).rotateX(Math.PI / 2).translate(0, 0, 0.5),
  sphere: () => new SphereGeometry(1, kSides, kRings),
  disc: () => new CylinderGeometry(1, 1, kDiscHeight, kSides).rotateX(Math.PI / 2),
};

export function makeShape(name) {
  const geometry = kMakers[name]();
  return {
    positions: geometry.getAttribute('position').array,
    normals: geometry.getAttribute('normal').array,
    indices: new Uint32Array(geometry.getIndex().array),
  };
}
