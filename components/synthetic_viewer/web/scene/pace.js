// How many pictures a second this browser draws while the scene moves, and whether the viewer's own pictures would be more. Pure.

const kFew_per_s = 3.5; // the viewer's come at 5 to 6 a second, from two cores beside a running system (README.md)
const kLooked_s = 2,
  kLooks = 3; // so much movement is looked at, so often in a row
const kMoving_s = 0.25; // what moves less often asks for few pictures

export class Pace {
  constructor() {
    this.begin();
  }
  // Forgets what it saw.
  begin() {
    Object.assign(this, {last_s: null, moving_s: 0, pictures: 0, looks: 0, fewLooks: 0, per_s: null});
  }
  drew() {
    ++this.pictures;
  }
  // The scene moved at `time_s` of the viewer's clock: however late this browser hears of it, it was to be drawn.
  moved(time_s) {
    const since_s = this.last_s === null ? 0 : time_s - this.last_s;
    this.last_s = time_s;
    if (since_s > 0 && since_s <= kMoving_s) this.moving_s += since_s;
    // No picture at all is not slow yet: the browser asks for none while its window is covered or it saves power. The
    // look goes on until one comes, which tells a browser that needs seconds for each from that.
    if (this.moving_s < kLooked_s || this.pictures === 0) return;
    this.per_s = this.pictures / this.moving_s;
    this.fewLooks = this.per_s < kFew_per_s ? this.fewLooks + 1 : 0;
    ++this.looks;
    this.moving_s = this.pictures = 0;
  }
  get few() {
    return this.fewLooks >= kLooks;
  }
}
