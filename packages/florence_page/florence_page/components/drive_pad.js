// Drives by hand while the manual override is on and somebody has asked for the pad: a pad to be dragged, and keys. It says ten times a second where the
// hand is; the robot stops when the hand lets go, and when nothing is heard of it.
import { robot } from "florence-live";

const SIZE = 150, EVERY_MS = 100;
// Forward and left, as in florence teleop.
const KEYS = {
  arrowup: [1, 0], arrowdown: [-1, 0], arrowleft: [0, 1], arrowright: [0, -1],
  i: [1, 0], ",": [-1, 0], j: [0, 1], l: [0, -1], u: [1, 1], o: [1, -1], m: [-1, -1], ".": [-1, 1],
};
const STEPS = "qzwxec";

export default {
  computed: { on() { return this.open && this.override; } },
  template: `<div v-if="on" style="display:flex;align-items:center;gap:.75rem;background:rgba(255,255,255,.92);border-radius:.5rem;padding:.5rem;box-sizing:border-box;max-width:calc(100vw - 1rem)">
    <div ref="pad" role="slider" aria-label="drive by hand" @pointerdown="press" @pointermove="move" @pointerup="let_go" @pointercancel="let_go"
      :style="{position:'relative',width:size+'px',height:size+'px',borderRadius:'50%',background:'#e8eef7',border:'2px solid #1f6fd6',touchAction:'none',cursor:'grab',flex:'none'}">
      <div :style="{position:'absolute',left:'50%',top:'50%',width:'46px',height:'46px',margin:'-23px',borderRadius:'50%',background:'#1f6fd6',
        transform:'translate(' + (-hand[1] * (size / 2 - 23)) + 'px,' + (-hand[0] * (size / 2 - 23)) + 'px)',pointerEvents:'none'}"></div>
    </div>
    <div style="font:13px/1.5 sans-serif">
      <b>Drive by hand</b><br>drag the disc, or hold the arrows or u i o j l m , .<br>
      {{ speeds[0] }} m/s, {{ speeds[1] }} rad/s
      <button @click="step('z')" title="slower (z)" style="padding:0 .5rem;border:1px solid #999;border-radius:.2rem">−</button>
      <button @click="step('q')" title="faster (q)" style="padding:0 .5rem;border:1px solid #999;border-radius:.2rem">+</button>
    </div>
  </div>`,
  data: () => ({ open: false, override: false, hand: [0, 0], speeds: ["?", "?"], size: SIZE }),
  mounted() {
    this.held = new Map(); this.timer = 0; this.pointer = null;
    const ceases = [
      robot.listen(({ state, override }) => {
        if (state) this.speeds = state.speeds || this.speeds;
        if (override) { if (!override.on && this.on) this.stop(); this.override = override.on; }
      }),
      robot.on_age((age) => { if (age) this.stop(); }),
    ];
    const listening = new AbortController(), signal = listening.signal;
    window.addEventListener("keydown", (event) => this.key_down(event), { signal });
    window.addEventListener("keyup", (event) => { if (this.held.delete(event.code)) this.by_keys(); }, { signal });
    window.addEventListener("blur", () => this.stop(), { signal });
    document.addEventListener("visibilitychange", () => { if (document.hidden) this.stop(); }, { signal });
    window.addEventListener("florence-pad", (event) => { if (!event.detail) this.stop(); this.open = event.detail; }, { signal });
    this.leave = () => { ceases.forEach((each) => each()); listening.abort(); };
  },
  unmounted() { this.stop(); this.leave(); },
  methods: {
    step(key) { robot.send(`speed ${key}`); },
    key_down(event) {
      const typing = event.target.closest && event.target.closest("input, textarea, [contenteditable]");
      if (!this.on || typing || event.ctrlKey || event.altKey || event.metaKey) return;
      const key = event.key.toLowerCase();
      if (STEPS.includes(key)) this.step(key);
      else if (KEYS[key]) { event.preventDefault(); this.held.set(event.code, KEYS[key]); this.by_keys(); }
      else this.stop();
    },
    by_keys() {
      const sum = [0, 1].map((i) => [...this.held.values()].reduce((all, each) => all + each[i], 0));
      this.push(sum.map((each) => Math.sign(each)));
    },
    press(event) {
      this.$refs.pad.setPointerCapture(event.pointerId); this.pointer = event.pointerId; this.move(event);
    },
    move(event) {
      if (this.pointer !== event.pointerId) return;
      const box = this.$refs.pad.getBoundingClientRect();
      const right = (event.clientX - box.left) / box.width * 2 - 1, down = (event.clientY - box.top) / box.height * 2 - 1;
      const far = Math.max(1, Math.hypot(right, down));
      this.push([-down / far, -right / far]);
    },
    let_go() { this.pointer = null; this.push([0, 0]); },
    stop() { this.held.clear(); this.let_go(); },
    push(hand) {
      const was = this.timer !== 0, now = hand[0] !== 0 || hand[1] !== 0;
      this.hand = hand;
      if (now && !was) { this.say(); this.timer = setInterval(() => this.say(), EVERY_MS); }
      if (!now && was) { clearInterval(this.timer); this.timer = 0; this.say(); }
    },
    say() {
      const { beat, age } = robot.press();
      robot.send(`drive ${this.hand.map((each) => each.toFixed(2)).join(" ")} ${beat} ${age.toFixed(3)}`);
    },
  },
};
