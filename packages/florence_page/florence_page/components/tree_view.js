// The tree of the running mission or of a recorded run, folded to what runs and what failed; a click folds and unfolds. In what runs
// now a click before a row sets a breakpoint, or takes it away. Only the rows in sight are drawn, so that thousands of nodes cost no
// more than a screen.
import { live } from "florence-live";

const ROW = 20, GUTTER = 20;
const SIGNS = { ".": "○", ">": "▶", "+": "✓", x: "✗", "-": "■" };
const COLOURS = { ".": "#999", ">": "#b07d00", "+": "#2a7f3b", x: "#b3261e", "-": "#8a6d00" };
const STYLE = `
.florence-gutter { position: absolute; left: 0; width: ${GUTTER}px; height: ${ROW}px; display: grid; place-items: center; }
.florence-gutter::before { content: ""; width: 10px; height: 10px; border-radius: 50%; }
.florence-gutter[data-breaks=true] { cursor: pointer; } .florence-gutter[data-breaks=true]:hover::before { background: #e3aeab; }
.florence-gutter[data-set=true]::before { background: #b3261e; }
.florence-tree:focus-visible { outline: 2px solid #1f6fd6; } .florence-tree:focus [data-chosen=true] { background: #dbe8fb; }
`;
let number = 0;

export default {
  template: `<div style="display:flex;flex-direction:column;height:100%;min-height:8rem">
    <input v-model="wanted" placeholder="find a node" aria-label="find a node" style="border:1px solid #ccc;padding:.2rem .4rem;margin-bottom:.3rem">
    <div ref="list" @scroll="top = $refs.list.scrollTop" @keydown="key_down" class="florence-tree" style="overflow:auto;flex:1;font:13px/20px ui-monospace,monospace"
      role="tree" tabindex="0" aria-label="tree" :aria-keyshortcuts="breaks ? 'ArrowUp ArrowDown Enter b' : 'ArrowUp ArrowDown Enter'" :aria-activedescendant="chosen === null ? null : uid + chosen">
      <div :style="{height: rows.length * 20 + 'px', position: 'relative'}">
        <template v-for="row in in_sight" :key="row.node">
          <span v-if="!nodes" @click="toggle_break(row.node)" class="florence-gutter" :data-set="broken.has(row.node)" :data-breaks="breaks"
            :title="broken.has(row.node) ? 'a breakpoint stands before this node' + (breaks ? ': a click or b takes it away' : '') : breaks ? 'set a breakpoint before this node (b)' : ''"
            :style="{top: row.at * 20 + 'px'}"></span>
          <div @click="choose(row); toggle(row)" role="treeitem" :id="uid + row.node" :aria-level="row.depth + 1" :aria-expanded="row.inner ? row.open : null"
             :aria-description="broken.has(row.node) ? 'breakpoint' : null" :data-chosen="row.node === chosen"
             :style="{position:'absolute',top:row.at * 20 + 'px',left:row.depth * 16 + gutter + 'px',whiteSpace:'pre',cursor:row.inner ? 'pointer' : 'default',color:row.colour,fontWeight:row.bold ? 'bold' : 'normal'}"
             >{{ row.inner ? (row.open ? '▾' : '▸') : ' ' }}{{ row.sign }} {{ row.name }}<span v-if="row.said" style="color:#777"> — {{ row.said }}</span></div>
        </template>
      </div>
    </div>
    <div v-if="!rows.length" style="color:#777">{{ nodes ? 'no node was reached' : 'no mission runs' }}</div>
  </div>`,
  props: { nodes: Array, cause: Number, breaks: Boolean },
  emits: ["break"],
  data() { return { rows: [], top: 0, height: 600, wanted: "", chosen: null, broken: new Set(), uid: `tree-${number++}-` }; },
  computed: {
    gutter() { return this.nodes ? 0 : GUTTER; },
    in_sight() {
      const first = Math.max(0, Math.floor(this.top / ROW) - 5);
      return this.rows.slice(first, first + Math.ceil(this.height / ROW) + 10);
    },
  },
  watch: { wanted() { this.lay_out(); } },
  mounted() {
    if (!document.getElementById("florence-tree-style")) {
      const style = document.createElement("style"); style.id = "florence-tree-style"; style.textContent = STYLE; document.head.append(style);
    }
    this.tree = []; this.marks = { statuses: "", said: {} }; this.opened = new Map();
    this.leave = this.nodes ? () => {} : this.follow();
    if (this.nodes) { this.tree = this.nodes; this.children = this.family(this.tree); this.lay_out(); }
    this.observer = new ResizeObserver(() => { this.height = this.$refs.list ? this.$refs.list.clientHeight : 600; });
    this.observer.observe(this.$refs.list);
  },
  unmounted() { this.leave(); this.observer.disconnect(); },
  methods: {
    // Show what runs now; gives what ends it.
    follow() {
      const ceases = [live.want("scene"), live.listen((parts) => {
        if (parts.tree) {
          if (parts.tree.length !== this.tree.length) this.chosen = null;
          this.tree = parts.tree; this.children = this.family(parts.tree); this.opened.clear();
        }
        if (parts.breakpoints) this.broken = new Set(parts.breakpoints.rows);
        if (parts.marks) this.marks = parts.marks;
        if (parts.tree || parts.marks || parts.breakpoints) this.lay_out();
      })];
      return () => ceases.forEach((each) => each());
    },
    // Of a recorded run: how its nodes stand at the moment that is looked at.
    show_tree({ tree, marks }) {
      if (tree.length !== this.tree.length) { this.opened.clear(); this.chosen = null; }
      this.tree = tree; this.children = this.family(tree); this.marks = marks; this.lay_out();
    },
    family(tree) {
      const children = tree.map(() => []);
      tree.forEach(([, parent], node) => { if (parent >= 0) children[parent].push(node); });
      return children;
    },
    choose(row) { this.chosen = row.node; },
    toggle_break(node) {
      if (this.breaks) this.$emit("break", { node, title: this.tree[node][0], ...live.press() });
    },
    key_down(event) {
      const at = this.rows.findIndex((row) => row.node === this.chosen), row = this.rows[at];
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      if (event.key === "ArrowDown" || event.key === "ArrowUp") this.go_to(Math.min(Math.max(at + (event.key === "ArrowDown" ? 1 : -1), 0), this.rows.length - 1));
      else if (event.key === "Enter" && row) this.toggle(row);
      else if (event.key === "b" && row && !event.repeat) this.toggle_break(row.node);
      else return;
      event.preventDefault();
    },
    go_to(at) {
      if (!this.rows[at]) return;
      this.choose(this.rows[at]);
      const { list } = this.$refs;
      list.scrollTop = Math.min(Math.max(list.scrollTop, (at + 1) * ROW - list.clientHeight), at * ROW);
    },
    toggle(row) {
      if (!row.inner) return;
      this.opened.set(row.node, !row.open); this.lay_out();
    },
    lay_out() {
      // A branch is open by itself while it runs, when it failed and its parent did, and when a breakpoint is in it.
      const { statuses, said } = this.marks, rows = [], wanted = this.wanted.trim().toLowerCase();
      const found = new Set(), opens = new Set();
      for (const from of [this.cause ?? -1, ...[...this.broken].map((node) => this.tree[node]?.[1] ?? -1)]) {
        for (let each = from; each >= 0; each = this.tree[each][1]) opens.add(each);
      }
      if (wanted) {
        this.tree.forEach(([name], node) => {
          if (!name.toLowerCase().includes(wanted)) return;
          for (let each = node; each >= 0; each = this.tree[each][1]) found.add(each);
        });
      }
      const add = (node, depth) => {
        if (wanted && !found.has(node)) return;
        const status = statuses[node] || ".", inner = this.children[node].length > 0;
        const open = inner && (wanted ? true : this.opened.get(node) ?? (status === ">" || status === "x" || status === "-" || opens.has(node)));
        rows.push({
          node, depth, inner, open, at: rows.length, name: this.tree[node][0], said: said[node],
          sign: SIGNS[status], colour: COLOURS[status], bold: node === this.cause,
        });
        if (open) this.children[node].forEach((child) => add(child, depth + 1));
      };
      this.tree.forEach(([, parent], node) => { if (parent < 0) add(node, 0); });
      this.rows = rows;
    },
  },
};
