// Whether what this browser draws is whole: a graphics driver may leave the bodies out of a picture and report no error.

const kWidth = 96,
  kHeight = 60; // of the small pictures that are compared
const kMinRadius = 2; // in their pixels: smaller ones may be hidden, or between them
const kMinDifference = 6; // of 255, in one colour
const kMin = 5; // bodies, of which none is seen: of fewer all may be too thin

export class WholeCheck {
  constructor() {
    const canvas = Object.assign(document.createElement('canvas'), {width: kWidth, height: kHeight});
    this.context = canvas.getContext('2d', {alpha: false, willReadFrequently: true});
  }
  small(canvas) {
    this.context.drawImage(canvas, 0, 0, kWidth, kHeight);
    return this.context.getImageData(0, 0, kWidth, kHeight).data;
  }

  // Draws twice by `draw(withBodies)`, which returns the canvas, and ends with the bodies in it. `circles`: where bodies are in the picture, { x, y, radius } in
  // shares of its width, height and height. Returns whether any of them changes it; null where those are too few or too small to tell.
  run(draw, circles) {
    const bare = this.small(draw(false)),
      whole = this.small(draw(true));
    const found = circles.map(circle => changedIn(circle, bare, whole)).filter(changed => changed !== null);
    return found.some(Boolean) || (found.length < kMin ? null : false);
  }
}

// Returns whether two small pictures differ within a circle; null where it is too small, or its middle beyond them.
function changedIn({x, y, radius}, bare, whole) {
  const reach = radius * kHeight,
    [cx, cy] = [x * kWidth, y * kHeight];
  if (!(reach >= kMinRadius && cx >= 0 && cx < kWidth && cy >= 0 && cy < kHeight)) return null;
  for (let row = Math.max(0, Math.floor(cy - reach)); row <= Math.min(kHeight - 1, cy + reach); ++row) {
    for (let column = Math.max(0, Math.floor(cx - reach)); column <= Math.min(kWidth - 1, cx + reach); ++column) {
      const at = 4 * (column + kWidth * row);
      for (let colour = 0; colour < 3; ++colour)
        if (Math.abs(bare[at + colour] - whole[at + colour]) >= kMinDifference) return true;
    }
  }
  return false;
}
