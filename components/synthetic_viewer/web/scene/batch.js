// Many items in one draw call: meshes side by side in one buffer, what differs between items in textures.

import {
  BatchedMesh,
  BufferAttribute,
  BufferGeometry,
  Color,
  DataTexture,
  FloatType,
  Matrix4,
  RGBAFormat,
  Sphere,
} from 'three';
import {kTexelsPerItem} from './look.js';

const kFirstItems = 64,
  kFirstVertices = 1 << 15,
  kFirstIndices = 1 << 17;
const colour = new Color(),
  matrix = new Matrix4();

export class Batch {
  // `makeMaterial`: of look.js. `findMesh(key)` gives { positions, normals, indices }, or nothing.
  constructor(makeMaterial, findMesh) {
    this.findMesh = findMesh;
    this.places = {value: this.newPlaces(kFirstItems)};
    this.material = makeMaterial(this.places);
    this.mesh = new BatchedMesh(kFirstItems, kFirstVertices, kFirstIndices, this.material);
    this.mesh.frustumCulled = false; // as a whole; each item is
    this.mesh.visible = false; // until the first item gives it colours: its program would be made without them
    this.geometries = new Map(); // by mesh key: { id, source, vertices, indices }
    this.items = []; // what each place shows: { mesh, views, … }
  }
  newPlaces(count) {
    const width = 4 * kTexelsPerItem;
    return new DataTexture(
      new Float32Array(4 * width * Math.ceil((count * kTexelsPerItem) / width)),
      width,
      Math.ceil((count * kTexelsPerItem) / width),
      RGBAFormat,
      FloatType,
    );
  }

  // Shows these items and nothing else: { mesh, W_from_mesh (Matrix4), colour, opacity, ownLight, views (bits), cut (whether a section cuts it), paint (of
  // Paint.lookUp), or null }. What has no mesh yet is left out.
  show(items) {
    const shown = items.filter(item => this.geometry(item.mesh) !== null);
    this.makeRoom(shown.length);
    shown.forEach((item, i) => {
      const {id} = this.geometries.get(item.mesh);
      if (i >= this.items.length) this.mesh.addInstance(id);
      else if (this.mesh.getGeometryIdAt(i) !== id) this.mesh.setGeometryIdAt(i, id);
      this.mesh.setMatrixAt(i, item.W_from_mesh);
      this.mesh.setColorAt(i, colour.setRGB(...item.colour));
      this.describe(i, item);
      this.mesh.setVisibleAt(i, true);
    });
    if (shown.length > 0 && this.items.length === 0) this.mesh.visible = true;
    for (let i = shown.length; i < this.items.length; ++i) this.mesh.setVisibleAt(i, false);
    this.items.length = Math.max(this.items.length, shown.length);
    for (let i = 0; i < this.items.length; ++i) this.items[i] = shown[i] ?? null;
    this.places.value.needsUpdate = true;
  }

  describe(i, {opacity, ownLight, cut, paint}) {
    const texels = this.places.value.image.data,
      at = 4 * kTexelsPerItem * i;
    texels.set([opacity, ownLight, cut ? 1 : 0, paint ? 1 : 0], at);
    if (!paint) return;
    paint.rows.forEach((row, k) => texels.set(row, at + 4 * (k + 1)));
    texels.set(paint.low, at + 16);
    texels.set(paint.high, at + 20);
  }

  // Hides what a view does not show. Returns how many items are left.
  select(viewBit) {
    let count = 0;
    this.items.forEach((item, i) => {
      const seen = item !== null && (item.views & viewBit) !== 0;
      this.mesh.setVisibleAt(i, seen);
      count += seen ? 1 : 0;
    });
    return count;
  }

  // The spheres round what is shown in W, marks left out.
  spheres() {
    return this.items.flatMap((item, i) =>
      item?.name === undefined
        ? []
        : [this.mesh.getBoundingSphereAt(this.mesh.getGeometryIdAt(i), new Sphere()).applyMatrix4(item.W_from_mesh)],
    );
  }

  // Returns the geometry of a mesh, which is put into the buffer at its first use; null while the mesh is not known.
  geometry(key) {
    const known = this.geometries.get(key);
    if (known) return known;
    const source = this.findMesh(key);
    if (!source) return null;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(source.positions, 3));
    geometry.setAttribute('normal', new BufferAttribute(source.normals, 3));
    geometry.setIndex(new BufferAttribute(source.indices, 1));
    geometry.computeBoundingBox();
    geometry.computeBoundingSphere();
    const vertices = source.positions.length / 3,
      indices = source.indices.length;
    if (vertices === 0 || indices === 0) return null;
    if (this.mesh.unusedVertexCount < vertices || this.mesh.unusedIndexCount < indices) {
      this.mesh.optimize();
      const {_maxVertexCount: mostVertices, _maxIndexCount: mostIndices} = this.mesh;
      const needed = (unused, most, more) => (unused >= more ? most : Math.max(2 * most, most + more));
      if (this.mesh.unusedVertexCount < vertices || this.mesh.unusedIndexCount < indices) {
        this.mesh.setGeometrySize(
          needed(this.mesh.unusedVertexCount, mostVertices, vertices),
          needed(this.mesh.unusedIndexCount, mostIndices, indices),
        );
      }
    }
    const made = {id: this.mesh.addGeometry(geometry)};
    this.geometries.set(key, made);
    return made;
  }

  // Forgets the meshes whose keys are not in `keys`. Only while no item shows one of them.
  keepOnly(keys) {
    const other = [...this.geometries].find(([key]) => keys.has(key));
    if (!other) return;
    for (const [key, {id}] of this.geometries) {
      if (keys.has(key)) continue;
      // A place that is not used must not go with the geometry that it had.
      this.items.forEach((item, i) => {
        if (item === null && this.mesh.getGeometryIdAt(i) === id) this.mesh.setGeometryIdAt(i, other[1].id);
      });
      this.mesh.deleteGeometry(id);
      this.geometries.delete(key);
    }
  }

  makeRoom(count) {
    const most = this.mesh.maxInstanceCount;
    if (count <= most) return;
    this.mesh.setInstanceCount(Math.max(2 * most, count));
    const before = this.places.value,
      after = this.newPlaces(this.mesh.maxInstanceCount);
    after.image.data.set(before.image.data);
    this.places.value = after;
    before.dispose();
  }
}
