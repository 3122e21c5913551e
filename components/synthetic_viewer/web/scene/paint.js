// The paint of the links: how close each place of the skin is, as volumes in one texture. The twin of skin_paint.cpp.

import {ClampToEdgeWrapping, Data3DTexture, LinearFilter, RedFormat, UnsignedByteType} from 'three';

const kMaxCubes = 64;

// Returns the volume of a link's box ([min x, y, z, max x, y, z] in the link's frame), all in no fluid.
function emptyVolume(box, patch_m) {
  const extents_m = [0, 1, 2].map(i => box[3 + i] - box[i] + 2 * patch_m);
  const edge_m = Math.max(patch_m / 2, Math.max(...extents_m) / kMaxCubes);
  const size = extents_m.map(extent_m => Math.max(1, Math.ceil(Math.fround(extent_m / edge_m))));
  return {edge_m, corner_m: [0, 1, 2].map(i => box[i] - patch_m), size};
}

// Whether two lists of patches are the same.
function same(a, b) {
  return (
    a.length === b.length &&
    a.every((patch, i) => {
      const other = b[i];
      return (
        patch.link === other.link &&
        patch.closeness === other.closeness &&
        patch.middle_m.every((m, axis) => m === other.middle_m[axis])
      );
    })
  );
}

export class Paint {
  constructor() {
    this.texture = this.newTexture(1, 1, 1);
    this.volumes = new Map(); // by link
    this.patch_m = 0;
    this.boxes = [];
    this.number = 0; // changes with the layout
    this.shown = []; // the patches that are painted
  }
  newTexture(width, height, depth) {
    const texture = new Data3DTexture(new Uint8Array(width * height * depth), width, height, depth);
    Object.assign(texture, {
      format: RedFormat,
      type: UnsignedByteType,
      minFilter: LinearFilter,
      magFilter: LinearFilter,
      unpackAlignment: 1,
      wrapS: ClampToEdgeWrapping,
      wrapT: ClampToEdgeWrapping,
      wrapR: ClampToEdgeWrapping,
      needsUpdate: true,
    });
    return texture;
  }

  // Boxes of the links, null where a link shows nothing.
  setBoxes(boxes) {
    this.boxes = boxes;
    this.patch_m = 0;
  }

  // The volumes stand on top of each other, along z.
  layOut(patch_m) {
    this.patch_m = patch_m;
    this.volumes.clear();
    let depth = 0,
      width = 1,
      height = 1;
    this.boxes.forEach((box, link) => {
      if (!box) return;
      const volume = emptyVolume(box, patch_m);
      volume.from = depth;
      [width, height, depth] = [
        Math.max(width, volume.size[0]),
        Math.max(height, volume.size[1]),
        depth + volume.size[2],
      ];
      this.volumes.set(link, volume);
    });
    this.texture.dispose();
    this.texture = this.newTexture(width, height, Math.max(1, depth));
    ++this.number;
  }

  // Paints what a message of the kind `paint` says. Returns whether the texture is another one than before.
  show({patch_m, patches}) {
    const another = patch_m > 0 && patch_m !== this.patch_m;
    if (another) this.layOut(patch_m);
    if (!(this.patch_m > 0) || (!another && same(patches, this.shown))) return another;
    this.texture.image.data.fill(0);
    this.shown = patches;
    for (const patch of patches) {
      const volume = this.volumes.get(patch.link);
      if (volume) this.splat(volume, patch);
    }
    this.texture.needsUpdate = true;
    return another;
  }

  splat(volume, {middle_m, closeness}) {
    const {data, width, height} = this.texture.image;
    const at = middle_m.map((m, i) => (m - volume.corner_m[i]) / volume.edge_m),
      reach = (2 * this.patch_m) / volume.edge_m;
    const low = at.map(a => Math.max(0, Math.ceil(a - reach - 0.5)));
    const high = at.map((a, i) => Math.min(volume.size[i] - 1, Math.floor(a + reach - 0.5)));
    const unit = volume.edge_m / this.patch_m,
      farthest2 = (2 / unit) ** 2;
    for (let z = low[2]; z <= high[2]; ++z) {
      for (let y = low[1]; y <= high[1]; ++y) {
        const row = width * (y + height * (z + volume.from)),
          across = (y + 0.5 - at[1]) ** 2 + (z + 0.5 - at[2]) ** 2;
        if (across >= farthest2) continue;
        const half = Math.sqrt(farthest2 - across),
          last = Math.min(high[0], Math.floor(at[0] + half - 0.5));
        for (let x = Math.max(low[0], Math.ceil(at[0] - half - 0.5)); x <= last; ++x) {
          const share = Math.min(1, 2 - Math.sqrt((x + 0.5 - at[0]) ** 2 + across) * unit) * closeness;
          const byte = Math.round(255 * share);
          if (byte > data[row + x]) data[row + x] = byte;
        }
      }
    }
  }

  // Returns { rows, low, high }: the matrix from a mesh to the texture by rows, and the link's part of the texture, half a texel within
  // its borders; null where the link has none. `link_from_mesh`: 12 numbers, by rows.
  lookUp(link, link_from_mesh) {
    const volume = this.volumes.get(link);
    if (!volume) return null;
    const {width, height, depth} = this.texture.image,
      whole = [width, height, depth],
      from = [0, 0, volume.from];
    const rows = [0, 1, 2].map(i => {
      const row = link_from_mesh.slice(4 * i, 4 * i + 4),
        per_m = 1 / (volume.edge_m * whole[i]);
      return [
        row[0] * per_m,
        row[1] * per_m,
        row[2] * per_m,
        (row[3] - volume.corner_m[i]) * per_m + from[i] / whole[i],
      ];
    });
    return {
      rows,
      low: from.map((f, i) => (f + 0.5) / whole[i]),
      high: from.map((f, i) => (f + volume.size[i] - 0.5) / whole[i]),
    };
  }
}
