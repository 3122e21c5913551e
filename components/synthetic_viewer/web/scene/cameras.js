// Cameras, and the viewer's own offsets of them: the laws of camera.cpp and camera_control.cpp. A camera is
// { eye_m, target_m, fov_rad, near_m, far_m }. Pure.

const kSteepest_rad = (89 * Math.PI) / 180,
  kMinZoom = 0.1,
  kMaxZoom = 4;
const kUsual = {near_m: 0.02, far_m: 20}; // of a cell whose scale is 1
const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
const half_turn = angle_rad => angle_rad - 2 * Math.PI * Math.round(angle_rad / (2 * Math.PI));

export class CameraOffset {
  constructor() {
    this.home();
  }
  home() {
    this.azimuth_rad = this.elevation_rad = 0;
    this.zoom = 1;
  }
  get moved() {
    return this.azimuth_rad !== 0 || this.elevation_rad !== 0 || this.zoom !== 1;
  }

  turn(azimuth_rad, elevation_rad) {
    this.azimuth_rad = half_turn(this.azimuth_rad + azimuth_rad);
    this.elevation_rad = clamp(this.elevation_rad + elevation_rad, -2 * kSteepest_rad, 2 * kSteepest_rad);
  }
  scale(zoom) {
    this.zoom = clamp(this.zoom * zoom, kMinZoom, kMaxZoom);
  }

  // Returns the camera moved about what it looks at. It never turns over the top.
  apply(camera) {
    if (!this.moved) return camera;
    const away = camera.eye_m.map((eye, i) => eye - camera.target_m[i]),
      distance_m = Math.hypot(...away);
    const azimuth_rad = Math.atan2(away[1], away[0]) + this.azimuth_rad;
    const elevation_rad = clamp(
      Math.asin(clamp(away[2] / distance_m, -1, 1)) + this.elevation_rad,
      -kSteepest_rad,
      kSteepest_rad,
    );
    const level = Math.cos(elevation_rad),
      reach_m = distance_m * this.zoom;
    const direction = [level * Math.cos(azimuth_rad), level * Math.sin(azimuth_rad), Math.sin(elevation_rad)];
    return {
      ...camera,
      eye_m: camera.target_m.map((target, i) => target + reach_m * direction[i]),
      near_m: Math.min(camera.near_m, 0.1 * reach_m),
      far_m: camera.far_m + distance_m * Math.max(0, this.zoom - 1),
    };
  }
}

// Where the main view stands by itself.
export function mainCamera(cell, view) {
  const {eye_m, look_at_m, near_m, far_m} = view.main;
  return {
    eye_m,
    target_m: look_at_m,
    fov_rad: cell.views.main.fov_rad,
    near_m: near_m ?? kUsual.near_m,
    far_m: far_m ?? kUsual.far_m,
  };
}

// The hit zone from the node that the viewer's host chose, or from `node` (1 … 14): from the nearest free distance on its line.
export function hitCamera(cell, hit, node = 0) {
  const {look_at_m, near_m, far_m} = hit;
  const chosen = cell.nodes.findIndex(n => n.number === node);
  const eye_m =
    chosen < 0 ? hit.eye_m : look_at_m.map((at, i) => at + hit.free_m[chosen] * cell.nodes[chosen].direction[i]);
  return {
    eye_m,
    target_m: look_at_m,
    fov_rad: cell.views.hit.fov_rad,
    near_m: near_m ?? kUsual.near_m,
    far_m: far_m ?? kUsual.far_m,
  };
}

// The view from the arm's tip. `X_WL`: matrix of its link (three's Matrix4); `free`: the share of the way to the eye that is free.
export function toolCamera(cell, X_WL, free) {
  const {eye_m, look_at_m, fov_rad} = cell.views.tool;
  const e = X_WL.elements,
    placed = p => [0, 1, 2].map(i => e[i] * p[0] + e[4 + i] * p[1] + e[8 + i] * p[2] + e[12 + i]);
  const target_m = placed(look_at_m),
    eye = placed(eye_m);
  return {
    eye_m: target_m.map((target, i) => target + free * (eye[i] - target)),
    target_m,
    fov_rad,
    near_m: cell.scale * (free < 1 ? 0.015 : kUsual.near_m),
    far_m: cell.scale * kUsual.far_m,
  };
}

// Gives three's camera a camera of ours. Up is z of W, or y of W where it looks straight up or down.
export function place(camera, {eye_m, target_m, fov_rad, near_m, far_m}, aspect) {
  const away = eye_m.map((eye, i) => eye - target_m[i]),
    steep = Math.abs(away[2]) > 0.999 * Math.hypot(...away);
  camera.up.set(0, steep ? 1 : 0, steep ? 0 : 1);
  camera.position.fromArray(eye_m);
  camera.lookAt(...target_m);
  Object.assign(camera, {fov: (fov_rad * 180) / Math.PI, aspect, near: near_m, far: far_m});
  camera.updateProjectionMatrix();
  camera.updateMatrixWorld(true);
}
