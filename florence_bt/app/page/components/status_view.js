// One line: what runs and how it stands, the battery, what holds the robot up, what it says.
import { live } from "florence-live";

const COLOURS = { SUCCEEDED: "#2a7f3b", ABORTED: "#b3261e", ACTIVE: "#1f6fd6", PENDING: "#1f6fd6", GONE: "#b3261e" };
const WORDS = { SUCCEEDED: "succeeded", ABORTED: "failed", PREEMPTED: "was stopped", ACTIVE: "runs", PENDING: "waits", GONE: "is gone" };

export default {
  template: `<div style="font:14px/1.4 sans-serif" role="status">
    <span v-if="!there" style="color:#b3261e;font-weight:bold">no connection; trying again… </span>
    <span v-else-if="run.mission"><a :href="'run?id=' + encodeURIComponent(run.run_id)" title="look at this run"><b>{{ run.mission }}</b></a> <span :style="{color}">{{ word }}</span>
      <span v-if="run.reason && run.state !== 'SUCCEEDED'"> — {{ run.reason }}</span></span>
    <span v-else>no mission has run yet</span>
    <span style="color:#666"> · battery {{ state.battery === null ? '?' : state.battery + ' %' }}</span>
    <span v-if="state.override" style="color:#b3261e;font-weight:bold"> · manual override: the base takes no commands of missions</span>
    <span v-if="state.stop" style="color:#b07d00"> · {{ state.stop }}</span>
    <span v-if="state.sure" style="color:#666"> · {{ state.sure }}</span>
    <span v-if="state.said"> · “{{ state.said }}”</span>
  </div>`,
  data: () => ({ there: true, run: {}, state: { battery: null } }),
  computed: {
    color() { return COLOURS[this.run.state] || "#8a6d00"; },
    word() { return WORDS[this.run.state] || this.run.state; },
  },
  mounted() {
    this.leave = live.listen((parts) => {
      if (parts.run) this.run = parts.run;
      if (parts.state) this.state = parts.state;
    });
    this.leave_state = live.on_state((there) => { this.there = there; });
  },
  unmounted() { this.leave(); this.leave_state(); },
};
