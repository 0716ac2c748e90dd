// One line: what runs and how it stands, the battery, what holds the robot up, what it says.
import { live } from "florence-live";

const COLOURS = { SUCCEEDED: "#2a7f3b", ABORTED: "#b3261e", ACTIVE: "#1f6fd6", PENDING: "#1f6fd6", GONE: "#b3261e" };
const WORDS = { SUCCEEDED: "succeeded", ABORTED: "failed", PREEMPTED: "was stopped", ACTIVE: "runs", PENDING: "waits", GONE: "is gone" };

export default {
  template: `<div style="font:14px/1.4 sans-serif" role="status" :title="run.reason">
    <span v-if="age" style="color:#8a5a00;font-weight:bold">{{ Math.round(age) }} s old: </span>
    <span v-else-if="'missions' in silent" style="color:#8a5a00;font-weight:bold">the mission server has said nothing for {{ silent.missions }} s: </span>
    <span v-if="run.mission"><a :href="'run?id=' + encodeURIComponent(run.run_id)" title="look at this run"><b :style="{color: old_run ? '#777' : null}">{{ run.mission }}</b></a> <span :style="{color}">{{ word }}</span>
      <span v-if="run.reason && run.state !== 'SUCCEEDED'" :style="{color: old_run ? '#777' : null}"> — {{ run.reason }}</span></span>
    <span v-else-if="!('missions' in silent)">no mission has run yet</span>
    <span style="color:#666"> · battery {{ state.battery !== null ? state.battery + ' %' : state.battery_was ? 'not known (' + state.battery_was + ')' : 'not known' }}</span>
    <span v-if="override" style="color:#b3261e;font-weight:bold"> · manual override{{ 'base' in silent ? ' was on ' + silent.base + ' s ago' : '' }}: the base takes no commands of missions</span>
    <span v-if="state.stop" :style="{color: 'base' in silent ? '#777' : '#b07d00'}"> · {{ 'base' in silent ? silent.base + ' s ago: ' : '' }}{{ state.stop }}</span>
    <span v-if="state.trouble" style="color:#b07d00"> · {{ state.trouble }}</span>
    <span v-if="state.sure" style="color:#666"> · {{ state.sure }}</span>
    <span v-if="state.said"> · “{{ state.said }}”</span>
  </div>`,
  data: () => ({ age: 0, silent: {}, override: false, run: {}, state: { battery: null } }),
  computed: {
    old_run() { return this.age > 0 || "missions" in this.silent; },
    color() { return this.old_run ? "#777" : this.run.paused ? "#8a6d00" : COLOURS[this.run.state] || "#8a6d00"; },
    word() { return this.run.paused && this.run.state === "ACTIVE" ? "is paused" : WORDS[this.run.state] || this.run.state; },
  },
  mounted() {
    this.leave = live.listen((parts) => {
      if (parts.run) this.run = parts.run;
      if (parts.state) this.state = parts.state;
      if (parts.override) this.override = parts.override.on;
      if (parts.silent) this.silent = parts.silent;
    });
    this.leave_age = live.on_age((age) => { this.age = age; });
  },
  unmounted() { this.leave(); this.leave_age(); },
};
