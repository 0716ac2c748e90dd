// Below the tree: where a paused run stands, with the buttons and keys to go on, and the breakpoints that are set, by whomever.
import { live } from "florence-live";

const FRESH_MS = 500; // as of a question: the finger may have been on its way to what was there before
const BUTTON = "border:1px solid #888;border-radius:4px;padding:2px 10px;background:#fff";

export default {
  template: `<div style="font:13px/1.6 sans-serif;max-height:8rem;overflow:auto">
    <div v-if="stands" role="group" aria-label="the run stands" style="display:flex;flex-wrap:wrap;gap:4px 8px;align-items:center;background:#fff4d6;border-radius:4px;padding:4px 8px">
      <span v-if="run.paused" role="status" aria-label="paused"><b>paused</b>: {{ run.reason }}</span>
      <span v-else>goes on to its next leaf…</span>
      <template v-if="acts">
        <button :disabled="!ready" @click="step" title="to the next leaf (s or →)" :style="button">Step</button>
        <button :disabled="!ready" @click="go_on" title="to the next breakpoint (c or space)" :style="button">Go on</button>
        <span class="max-sm:hidden" style="color:#666">keys: s, c</span>
      </template>
    </div>
    <div v-if="names.length" role="group" aria-label="breakpoints" style="display:flex;flex-wrap:wrap;gap:0 10px;padding:2px 8px">
      <span style="color:#666">paused before</span>
      <span v-for="name in names" :key="name"><span style="color:#b3261e">●</span> <span :title="name">{{ short(name) }}</span>
        <button v-if="acts" @click="say('remove', { name })" :aria-label="'take away ' + name" style="padding:0 6px">✕</button></span>
    </div>
  </div>`,
  props: { acts: Boolean },
  emits: ["step", "go_on", "remove"],
  data: () => ({ run: {}, names: [], silent: {}, age: 0, stepping: "", fresh: false, button: BUTTON }),
  computed: {
    // After a step the bar stays for the next one, in its place.
    stands() { return this.run.state === "ACTIVE" && (this.run.paused || this.stepping === this.run.run_id); },
    ready() { return this.run.paused && !this.fresh && !this.age && !("missions" in this.silent); },
  },
  watch: {
    stands(now) {
      clearTimeout(this.timer);
      this.fresh = now; if (now) this.timer = setTimeout(() => { this.fresh = false; }, FRESH_MS);
    },
  },
  mounted() {
    const ceases = [
      live.listen(({ run, breakpoints, silent }) => {
        if (run) this.run = run;
        if (breakpoints) this.names = breakpoints.names;
        if (silent) this.silent = silent;
      }),
      live.on_age((age) => { this.age = age; }),
    ];
    const listening = new AbortController();
    if (this.acts) window.addEventListener("keydown", (event) => this.key_down(event), { signal: listening.signal });
    this.leave = () => { ceases.forEach((each) => each()); listening.abort(); clearTimeout(this.timer); };
  },
  unmounted() { this.leave(); },
  methods: {
    // Keys are those of the page as a whole: not while somebody types, has a button or a dialog, or drives by hand.
    key_down(event) {
      const busy = event.target.closest && event.target.closest("input, textarea, button, a, [contenteditable], [role=dialog], .q-dialog");
      if (!this.stands || !this.ready || busy || event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
      const acts = { s: this.step, ArrowRight: this.step, c: this.go_on, " ": this.go_on }[event.key];
      if (acts) { event.preventDefault(); acts(); }
    },
    // Of a whole path the two ends.
    short(name) { const parts = name.split("/"); return parts.length > 2 ? `${parts[0]}/…/${parts.at(-1)}` : name; },
    step() { this.stepping = this.run.run_id; this.say("step", { run_id: this.run.run_id }); },
    go_on() { this.stepping = ""; this.say("go_on", { run_id: this.run.run_id }); },
    say(what, about) { this.$emit(what, { ...about, ...live.press() }); },
  },
};
