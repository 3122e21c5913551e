// What depth cameras see and the model does not have: its voxels as the workspace has them, asked for while there are any.

import {decodeShell} from './fluid.js';

const kObject = 65534,
  kBody = 100,
  kAsk_ms = 500;
const kPath = `fluid/shell/${kObject}/${kBody}`;
// The id of the small cube in its middle, which stands for it where its voxels are not shown.
export const kLiveMarker = `object:${kObject}`;

export class LiveMatter {
  // `stage`: what draws; `isShown()`: whether the browser draws; `changed()`: draw it again.
  constructor(stage, isShown, changed) {
    Object.assign(this, {stage, isShown, changed, tag: null, looking: false});
    setInterval(() => this.look(), kAsk_ms);
  }

  show(shells, tag) {
    if (tag === this.tag) return;
    this.tag = tag;
    this.stage.showLive(shells);
    this.changed();
  }

  async look() {
    if (!this.stage.items.has(kLiveMarker)) return this.show([], null);
    if (!this.isShown() || document.hidden || this.looking) return undefined;
    this.looking = true;
    try {
      const response = await fetch(kPath, {cache: 'no-cache'}); // by its hash: what is known does not come again
      if (response.ok) this.show([decodeShell(await response.arrayBuffer())], response.headers.get('ETag'));
      else if (response.status === 404) this.show([], null);
    } catch (problem) {
      /* the viewer is away: what it said last stays, as the rest of the picture does */
    }
    this.looking = false;
    return undefined;
  }
}
