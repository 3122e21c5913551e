// node write_rooms.mjs PACKAGES FOLDER: writes each room that @iwer/sem has captured as FOLDER/NAME.ply, in metres, z up.
import {mkdirSync, readdirSync, readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

const [packages, folder] = process.argv.slice(2),
  captures = join(packages, 'node_modules/@iwer/sem/captures');
mkdirSync(folder, {recursive: true});

function plyOf({vertices, indices}) {
  const points = Buffer.from(vertices, 'base64'),
    corners = Buffer.from(indices, 'base64'),
    count = points.length / 12,
    triangles = corners.length / 12,
    head = Buffer.from(
      `ply\nformat binary_little_endian 1.0\nelement vertex ${count}\nproperty float x\nproperty float y\n` +
        `property float z\nelement face ${triangles}\nproperty list uchar int vertex_indices\nend_header\n`,
    ),
    turned = Buffer.alloc(points.length),
    faces = Buffer.alloc(triangles * 13);
  for (let i = 0; i < count; ++i) {
    const [x, y, z] = [0, 4, 8].map(at => points.readFloatLE(12 * i + at)); // y is up
    [x, -z, y].forEach((value, axis) => turned.writeFloatLE(value, 12 * i + 4 * axis));
  }
  for (let i = 0; i < triangles; ++i) {
    faces[13 * i] = 3;
    corners.copy(faces, 13 * i + 1, 12 * i, 12 * i + 12);
  }
  return Buffer.concat([head, turned, faces]);
}

for (const file of readdirSync(captures)) {
  const room = JSON.parse(readFileSync(join(captures, file))),
    mesh = room.spatialEntities.find(entity => entity.triangleMesh_META)?.triangleMesh_META;
  if (!mesh) throw new Error(`${file}: no entity of it has a triangleMesh_META`);
  writeFileSync(join(folder, file.replace('.json', '.ply')), plyOf(mesh));
}
