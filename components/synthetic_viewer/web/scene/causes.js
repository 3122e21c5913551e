// What limits the hand, felt and heard in the headset: each cause has a pattern of its own, in vibration and tone
// alike.
//
// A person tells patterns apart by what stands out, and counts up to four at a glance (Kaufman et al. 1949; of tactile
// icons rhythm is told best, Brown, Brewster and Purchase 2005). So there are three families, by length and pitch of
// their pulses, and within a family the number of pulses is the cause:
//   long and low      the arm does not follow     1 a stop, 2 nothing comes, 3 an enabling switch, 4 alignment
//   short and high    the arm goes no farther     1 a joint's end, 2 a singular pose
//   short, then long  less is felt than there is  1 a guard of stability, 2 the delay, 3 no force sensor, or the
//                                                 drag is masked, 4 the greatest torque

const kLong_ms = 360,
  kRest_ms = 280, // the second of a pair: four pairs last 2.4 s
  kShort_ms = 90,
  kGap_ms = 170,
  kPairGap_ms = 60;
const kLow_Hz = 220,
  kHigh_Hz = 880,
  kMiddle_Hz = 466; // no two an octave apart by chance: 1 : 4 : 2.1
const kHush_ms = 150; // so long before and after a pattern the closeness does not vibrate
const kSettles_ms = {follows: 0, farther: 150, felt: 400}; // so long a cause stands before it is told
const kAgain_ms = {follows: 4000, farther: 6000, felt: 12000}; // from telling to telling of a cause that stands or comes back

const pulse = (on_ms, off_ms, strength, tone_Hz) => ({on_ms, off_ms, strength, tone_Hz});
const kPulses = {
  follows: [pulse(kLong_ms, kGap_ms, 1, kLow_Hz)],
  farther: [pulse(kShort_ms, kGap_ms, 1, kHigh_Hz)],
  felt: [pulse(kShort_ms, kPairGap_ms, 0.8, kMiddle_Hz), pulse(kRest_ms, kGap_ms, 0.5, kMiddle_Hz)],
};
const kCauses = {
  'limit.stopped': ['follows', 1],
  'limit.arm_silent': ['follows', 2],
  'limit.master_silent': ['follows', 2],
  'limit.link': ['follows', 2],
  'limit.master_switch': ['follows', 3],
  'limit.arm_switch': ['follows', 3],
  'limit.alignment': ['follows', 4],
  'limit.waits': ['follows', 4],
  'limit.joint': ['farther', 1],
  'limit.singular': ['farther', 2],
  'limit.damped': ['felt', 1],
  'limit.percept': ['felt', 1],
  'limit.delay': ['felt', 2],
  'limit.no_force_sensor': ['felt', 3],
  'limit.masked': ['felt', 3],
  'limit.percept_capped': ['felt', 4],
  'limit.feedback_capped': ['felt', 4],
};

// Returns the pattern of a limit, by the key of its words: { family, count, pulses: [{ on_ms, off_ms, strength, tone_Hz
// }] }; null: it has none.
export function patternOf(key) {
  const [family, count] = Object.hasOwn(kCauses, key) ? kCauses[key] : [];
  return family ? {family, count, pulses: Array.from({length: count}, () => kPulses[family]).flat()} : null;
}

// Tells the leading cause, once it stands, and again while it does. Time comes in: ms.
export class CauseSignal {
  // `play(pulse)`: makes one pulse felt and heard.
  constructor(play) {
    Object.assign(this, {
      play,
      name: null,
      since_ms: 0,
      told: new Map(),
      rest: [],
      next_ms: -Infinity,
      quiet_ms: -Infinity,
    });
  }

  // At each frame. `key`: of the leading limit; null: nothing limits the hand, or it is not known. Returns whether a
  // pattern is being told: nothing else shall vibrate meanwhile. A late frame delays a pulse and leaves none out, as
  // they are counted.
  step(now_ms, key) {
    const pattern = key === null ? null : patternOf(key),
      name = pattern && pattern.family + pattern.count;
    if (name !== this.name) Object.assign(this, {name, since_ms: now_ms});
    if (!this.rest.length && now_ms >= this.quiet_ms && pattern && this.due(now_ms, pattern)) {
      this.told.set(name, now_ms);
      Object.assign(this, {rest: [...pattern.pulses], next_ms: now_ms + kHush_ms});
    }
    if (this.rest.length && now_ms >= this.next_ms) {
      const one = this.rest.shift();
      this.play(one);
      this.next_ms = now_ms + one.on_ms + one.off_ms;
      this.quiet_ms = now_ms + one.on_ms + kHush_ms;
    }
    return this.rest.length > 0 || now_ms < this.quiet_ms;
  }
  due(now_ms, {family, count}) {
    return (
      now_ms - this.since_ms >= kSettles_ms[family] &&
      now_ms - (this.told.get(family + count) ?? -Infinity) >= kAgain_ms[family]
    );
  }
}

const kLoud = 0.12,
  kEdge_s = 0.012;

// The tone of a pulse, in the browser's own sound. It needs a press of the user's before, as entering the headset is
// one.
export class Beeper {
  constructor(Context = globalThis.AudioContext) {
    this.context = Context ? new Context() : null;
  }
  play({on_ms, tone_Hz, strength}) {
    const {context} = this;
    if (!context) return;
    const from = context.currentTime,
      until = from + on_ms / 1000;
    const oscillator = context.createOscillator(),
      gain = context.createGain();
    Object.assign(oscillator, {type: 'triangle'});
    oscillator.frequency.value = tone_Hz;
    gain.gain.setValueAtTime(0, from);
    gain.gain.linearRampToValueAtTime(kLoud * strength, from + kEdge_s);
    gain.gain.setValueAtTime(kLoud * strength, until - kEdge_s);
    gain.gain.linearRampToValueAtTime(0, until);
    oscillator.connect(gain).connect(context.destination);
    oscillator.start(from);
    oscillator.stop(until);
  }
  end() {
    this.context?.close();
  }
}
