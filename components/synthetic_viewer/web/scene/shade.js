// A mesh as the graphics card takes it: the twin of shade() in shaded_mesh.cpp. Pure.

const kMinCosine = Math.cos(0.6),
  kMaxCorners = 512,
  kTries = 16;

// Numbers the places of vertices: those at the same position have the same number.
function weld(vertices_m) {
  const count = vertices_m.length / 3,
    bits = new Uint32Array(vertices_m.slice().map(v => v + 0).buffer); // −0 is 0
  const place = new Uint32Array(count),
    heads = new Map();
  const next = new Int32Array(count).fill(-1);
  for (let v = 0; v < count; ++v) {
    const x = bits[3 * v],
      y = bits[3 * v + 1],
      z = bits[3 * v + 2];
    const hash = (Math.imul(x, 73856093) ^ Math.imul(y, 19349663) ^ Math.imul(z, 83492791)) >>> 0;
    const head = heads.get(hash) ?? -1;
    let known = head;
    while (known >= 0 && (bits[3 * known] !== x || bits[3 * known + 1] !== y || bits[3 * known + 2] !== z))
      known = next[known];
    if (known >= 0) {
      place[v] = place[known];
      continue;
    }
    place[v] = v;
    next[v] = head;
    heads.set(hash, v);
  }
  return place;
}

// Returns { positions, normals, indices }: normals smooth over bends below 0.6 rad, sharp elsewhere; triangles without area are left out.
export function shade({vertices_m, corners}) {
  const triangles = [],
    face = []; // source corners; unit normal and double area of each
  for (let t = 0; t < corners.length; t += 3) {
    const [a, b, c] = [3 * corners[t], 3 * corners[t + 1], 3 * corners[t + 2]];
    const ux = vertices_m[b] - vertices_m[a],
      uy = vertices_m[b + 1] - vertices_m[a + 1],
      uz = vertices_m[b + 2] - vertices_m[a + 2];
    const vx = vertices_m[c] - vertices_m[a],
      vy = vertices_m[c + 1] - vertices_m[a + 1],
      vz = vertices_m[c + 2] - vertices_m[a + 2];
    const nx = uy * vz - uz * vy,
      ny = uz * vx - ux * vz,
      nz = ux * vy - uy * vx,
      length = Math.hypot(nx, ny, nz);
    if (!(length > 0)) continue;
    triangles.push(corners[t], corners[t + 1], corners[t + 2]);
    face.push(nx / length, ny / length, nz / length, length);
  }
  const placeOf = weld(vertices_m);
  const first = new Int32Array(vertices_m.length / 3).fill(-1),
    size = new Uint32Array(first.length),
    next = new Int32Array(triangles.length);
  for (let corner = 0; corner < triangles.length; ++corner) {
    const place = placeOf[triangles[corner]];
    next[corner] = first[place];
    first[place] = corner;
    ++size[place];
  }
  const positions = [],
    normals = [],
    indices = new Uint32Array(triangles.length);
  for (let corner = 0; corner < triangles.length; ++corner) {
    const f = 4 * Math.floor(corner / 3),
      source = triangles[corner],
      place = placeOf[source];
    let [x, y, z] = [face[f], face[f + 1], face[f + 2]];
    if (size[place] <= kMaxCorners) {
      const [fx, fy, fz] = [x, y, z];
      x = y = z = 0;
      for (let other = first[place]; other >= 0; other = next[other]) {
        const g = 4 * Math.floor(other / 3);
        if (face[g] * fx + face[g + 1] * fy + face[g + 2] * fz < kMinCosine) continue;
        x += face[g] * face[g + 3];
        y += face[g + 1] * face[g + 3];
        z += face[g + 2] * face[g + 3];
      }
    }
    const length = Math.hypot(x, y, z) || 1;
    let index = -1;
    for (let other = next[corner], tries = 0; other >= 0 && tries < kTries; other = next[other], ++tries) {
      const n = 3 * indices[other];
      if (normals[n] * x + normals[n + 1] * y + normals[n + 2] * z > 0.99999 * length) {
        index = indices[other];
        break;
      }
    }
    if (index < 0) {
      index = positions.length / 3;
      positions.push(vertices_m[3 * source], vertices_m[3 * source + 1], vertices_m[3 * source + 2]);
      normals.push(x / length, y / length, z / length);
    }
    indices[corner] = index;
  }
  return {positions: new Float32Array(positions), normals: new Float32Array(normals), indices};
}

// A coarse version of a mesh in one piece with normals of no meaning, for shadows: vertices within a cube of `pitch_m` are merged, and
// triangles that collapse are left out. The twin of coarsen() in shaded_mesh.cpp.
export function coarsen({vertices_m, corners}, pitch_m) {
  const cubeOf = new Uint32Array(vertices_m.length / 3),
    cubes = new Map(),
    sums = [];
  for (let v = 0; v < cubeOf.length; ++v) {
    const [x, y, z] = [vertices_m[3 * v], vertices_m[3 * v + 1], vertices_m[3 * v + 2]];
    const key = `${Math.floor(x / pitch_m)} ${Math.floor(y / pitch_m)} ${Math.floor(z / pitch_m)}`;
    let cube = cubes.get(key);
    if (cube === undefined) cubes.set(key, (cube = sums.push([0, 0, 0, 0]) - 1));
    const sum = sums[cube];
    sum[0] += x;
    sum[1] += y;
    sum[2] += z;
    ++sum[3];
    cubeOf[v] = cube;
  }
  const known = new Set(),
    indices = [];
  for (let t = 0; t < corners.length; t += 3) {
    const triangle = [cubeOf[corners[t]], cubeOf[corners[t + 1]], cubeOf[corners[t + 2]]],
      [a, b, c] = triangle;
    if (a === b || b === c || c === a) continue;
    const key = [...triangle].sort((x, y) => x - y).join(' ');
    if (known.has(key)) continue;
    known.add(key);
    indices.push(a, b, c);
  }
  const positions = new Float32Array(3 * sums.length);
  sums.forEach(([x, y, z, n], i) => positions.set([x / n, y / n, z / n], 3 * i));
  return {positions, normals: new Float32Array(positions.length), indices: new Uint32Array(indices)};
}
