// STOP THE ROBOT, in its place above everything, with what is known of it; driving by hand; the release.
//
// A stop lives here, in the browser, and not in a session of the server: it has an id and is sent again and again, over broken
// lines and reloads, until the base's driver has counted that very stop. Everything else is sent once, for what is on the screen.
import { robot } from "florence-live";
import { LOST } from "florence-live/session.js";

const KEPT = "florence_stop", AGAIN_MS = 250, ABORT_MS = 1200, MOST_AT_ONCE = 3, UNSURE_MS = 1000, NOTE_MS = 5000, LOOK_MS = 100;
const DRIVEN = "the robot is stopped for missions; a hand drives it"; // as the server says it
const LET_GO = "driving by hand is off";
const BY_HAND = "switch the robot off by hand";
const STYLE = `
.florence-bar { position: fixed; left: 0; right: 0; bottom: 0; z-index: 2147483000; height: var(--florence-bar); box-sizing: border-box; padding: 8px;
  display: grid; grid-template: "stop word hand release" 1fr / 15rem 1fr 9rem 8rem; gap: 8px; background: #fff; border-top: 1px solid #bbb; font: 15px/1.25 sans-serif; }
.florence-bar button { border-radius: 6px; border: 1px solid #888; background: #fff; color: #222; font: inherit; touch-action: manipulation; }
.florence-bar button:disabled { color: #999; border-color: #ddd; }
.florence-bar button:focus-visible { outline: 3px solid #1f6fd6; outline-offset: 1px; }
.florence-bar .stop { grid-area: stop; background: #b3261e; border-color: #7c1410; color: #fff; font-weight: bold; font-size: 17px; touch-action: none; }
.florence-bar .stop:active { background: #7c1410; }
.florence-bar .word { grid-area: word; align-self: center; max-height: 100%; overflow: hidden; }
.florence-bar .word button { padding: 0 6px; }
.florence-bar .hand { grid-area: hand; } .florence-bar .hand[aria-pressed="true"] { background: #dbe8fb; }
.florence-bar .release { grid-area: release; }
.florence-bar [data-state="unsure"] { background: #b3261e; color: #fff; font-weight: bold; padding: 4px 8px; border-radius: 6px; }
.florence-bar [data-state="stopped"] { color: #1d6b2f; font-weight: bold; }
.florence-bar [data-state="old"] { color: #8a5a00; font-weight: bold; }
:root { --florence-bar: 64px; }
@media (max-width: 640px) {
  :root { --florence-bar: 148px; }
  .florence-bar { grid-template: "word word" 1fr "hand release" 34px "stop stop" 52px / 1fr 1fr; gap: 5px; padding: 5px 8px; }
}
html[data-old~="page"] .shows-robot, html[data-old~="missions"] .shows-missions { filter: grayscale(1) opacity(.45); }
`;

export default {
  template: `<teleport to="body"><div class="florence-bar" role="region" aria-label="the robot">
    <button class="stop" @pointerdown="$event.button === 0 && press_stop()" @click="$event.detail === 0 && press_stop()">STOP THE ROBOT</button>
    <div class="word" role="alert" :data-state="said.state">{{ said.word }}
      <span v-if="lost">{{ said.word && "· " }}The page's program was started again: <button @click="reload">open the page again</button></span></div>
    <button class="hand" :aria-pressed="pad" :disabled="!sees" @click="drive">Drive by hand</button>
    <button class="release" :disabled="!sees || !(override && override.on)" @click="release">Release</button>
  </div></teleport>`,
  data: () => ({ override: null, silent: {}, age: 0, press: null, confirmed: null, problem: "", note: null, pad: false, let_go: false, lost: false, now: Date.now() }),
  computed: {
    // Whether what is on the screen is of now, and the base's driver speaks.
    sees() { return !this.age && this.override !== null && !("base" in this.silent); },
    said() {
      const { override, now } = this;
      if (this.press) {
        if (now - this.press.began < UNSURE_MS) return { state: "sending", word: "sending the stop…" };
        return { state: "unsure", word: `NOT CONFIRMED: ${BY_HAND} (${this.problem || "no answer"}; it is sent again and again)` };
      }
      if (this.note && now - this.note.at < NOTE_MS) return this.note;
      if (this.age) {
        const was = this.confirmed && now - this.confirmed < 3600e3 ? ` The robot was stopped ${Math.round((now - this.confirmed) / 1000)} s ago.` : "";
        return { state: "old", word: `no connection for ${Math.round(this.age)} s: what you see is old.${was}` };
      }
      if (!override) return { state: "old", word: "no driver of a base has been heard" };
      if ("base" in this.silent) return { state: "old", word: `the base's driver has said nothing for ${this.silent.base} s` };
      if (!override.on) return { state: "free", word: "" };
      if (override.problem) return { state: "unsure", word: `NOT CONFIRMED: ${BY_HAND} (${override.problem})` };
      if (override.standing) return { state: "stopped", word: "the robot is stopped; missions cannot move it until it is released" };
      return { state: "hand", word: override.by_hand ? "a hand drives the robot" : "stopping: the wheels still turn" };
    },
  },
  mounted() {
    if (!document.getElementById("florence-bar-style")) {
      const style = document.createElement("style"); style.id = "florence-bar-style"; style.textContent = STYLE; document.head.append(style);
    }
    const leave = [
      robot.listen(({ override, silent }) => { if (override) this.heed(override); if (silent) this.silent = silent; }),
      robot.on_age((age) => { this.age = age; }),
    ];
    const listening = new AbortController(), signal = listening.signal;
    window.addEventListener(LOST, () => { this.lost = true; }, { signal });
    const timer = setInterval(() => { this.now = Date.now(); }, LOOK_MS);
    this.leave = () => { leave.forEach((each) => each()); listening.abort(); clearInterval(timer); };
    const kept = sessionStorage.getItem(KEPT);
    if (kept) this.send(JSON.parse(kept));
  },
  unmounted() { this.leave(); },
  methods: {
    heed(override) {
      // A stop that somebody else has pressed, on another page or in a terminal, lets go of this hand, too.
      const counted = this.override && override.on && override.stops !== this.override.stops;
      this.override = override;
      if (counted && this.unseen && !this.press) this.unseen = false; // that was the stop which the pad began with
      else if (this.pad && !this.press && !this.unseen && (counted || !override.on)) {
        this.show_pad(false);
        if (counted) this.note = { state: "stopped", word: `somebody has stopped the robot: ${LET_GO}`, at: Date.now() };
      }
      const obeyed = override.on && !override.problem && (override.standing || override.by_hand);
      if (this.press && obeyed && override.stops !== this.press.stops) this.end(override.by_hand ? DRIVEN : "the robot is stopped");
    },
    pends(press) { return this.press !== null && this.press.id === press.id; },
    end(word) {
      this.unseen = this.pad && (!this.override || this.override.stops === this.press.stops);
      this.press = null; this.confirmed = Date.now(); sessionStorage.removeItem(KEPT);
      const told = this.let_go ? `${word}; ${LET_GO}` : word, shown_ms = this.let_go ? NOTE_MS : 1500;
      this.let_go = false;
      this.note = { state: word === DRIVEN ? "hand" : "stopped", word: told, at: Date.now() - NOTE_MS + shown_ms };
    },
    press_stop() {
      if (this.pad) { this.let_go = true; this.show_pad(false); }
      this.stop();
    },
    stop() {
      this.note = null;
      if (this.press) { this.ask(this.press); return; }
      const id = `${Date.now().toString(36)}-${Math.random().toString(36).slice(2)}`;
      this.send({ id, began: Date.now(), stops: this.override && this.override.stops });
    },
    async send(press) {
      this.now = Date.now(); this.press = press; this.problem = ""; this.asking = 0;
      sessionStorage.setItem(KEPT, JSON.stringify(press));
      while (this.pends(press)) {
        if (this.asking < MOST_AT_ONCE) this.ask(press);
        await new Promise((done) => setTimeout(done, AGAIN_MS));
      }
    },
    async ask(press) {
      this.asking += 1;
      const answer = await this.post("/robot/stop", { id: press.id });
      this.asking -= 1;
      if (!this.pends(press)) return;
      if (answer.confirmed) this.end(answer.word);
      else this.problem = answer.word;
    },
    async release() {
      const answer = await this.post("/robot/release", { ...robot.press(), stops: this.override.stops });
      const word = answer.done || answer.word.startsWith("not released") ? answer.word : `not released: ${answer.word}`;
      this.note = { state: answer.done ? "free" : "old", word, at: Date.now() };
    },
    // What was not answered has no effect, or says so: a release counts for a second.
    async post(path, body) {
      const ending = new AbortController(), timer = setTimeout(() => ending.abort(), ABORT_MS);
      try {
        const answer = await fetch(path, {
          method: "POST", keepalive: true, signal: ending.signal, headers: { "content-type": "application/json" }, body: JSON.stringify(body),
        });
        const text = await answer.text();
        return answer.ok ? JSON.parse(text) : { word: text.slice(0, 200) };
      } catch (error) {
        return { word: "no connection to the robot" };
      } finally { clearTimeout(timer); }
    },
    drive() {
      if (this.pad) { this.show_pad(false); return; }
      if (!this.override.on) this.stop();
      this.show_pad(true);
    },
    show_pad(open) { this.pad = open; window.dispatchEvent(new CustomEvent("florence-pad", { detail: open })); },
    reload() { location.reload(); },
  },
};
