// What depth cameras see and the model does not have: its voxels as the workspace has them, asked for while there are any.

import {decodeShell} from './fluid.js';

const kFirstObject = 65519, // the ids of its objects, the last of them what has no object of its own
  kLastObject = 65534,
  kBody = 100,
  kAsk_ms = 500;

// Returns the id of what is seen that an item of the scene is the marker of; null: of none. A small cube in its middle
// stands for it where its voxels are not shown.
export function liveObject(item) {
  const id = item.startsWith('object:') ? Number(item.slice('object:'.length)) : NaN;
  return id >= kFirstObject && id <= kLastObject ? id : null;
}

export class LiveMatter {
  // `stage`: what draws; `isShown()`: whether the browser draws; `changed()`: draw it again.
  constructor(stage, isShown, changed) {
    Object.assign(this, {stage, isShown, changed, known: new Map(), looking: false});
    setInterval(() => this.look(), kAsk_ms);
  }

  show() {
    this.stage.showLive(new Map([...this.known].map(([id, {shell}]) => [id, shell])));
    this.changed();
  }

  // Returns whether the shell of an object is another than before.
  async ask(id) {
    const response = await fetch(`fluid/shell/${id}/${kBody}`, {cache: 'no-cache'}); // by its hash: what is known does not come again
    if (response.status === 404) return this.known.delete(id);
    const tag = response.headers?.get('ETag');
    if (!response.ok || this.known.get(id)?.tag === tag) return false;
    this.known.set(id, {tag, shell: decodeShell(await response.arrayBuffer())});
    return true;
  }

  async look() {
    const there = [...this.stage.items.keys()].map(liveObject).filter(id => id !== null);
    let differs = false;
    for (const id of this.known.keys()) if (!there.includes(id)) differs = this.known.delete(id) || differs;
    if (there.length && this.isShown() && !document.hidden && !this.looking) {
      this.looking = true;
      try {
        for (const id of there) differs = (await this.ask(id)) || differs;
      } catch (problem) {
        /* the viewer is away: what it said last stays, as the rest of the picture does */
      }
      this.looking = false;
    }
    if (differs) this.show();
  }
}
