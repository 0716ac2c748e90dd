// The tree of the running mission or of a recorded run, folded to what runs and what failed; a click folds and unfolds. Only the rows in
// sight are drawn, so that thousands of nodes cost no more than a screen.
import { live } from "florence-live";

const ROW = 20;
const SIGNS = { ".": "○", ">": "▶", "+": "✓", x: "✗", "-": "■" };
const COLOURS = { ".": "#999", ">": "#b07d00", "+": "#2a7f3b", x: "#b3261e", "-": "#8a6d00" };

export default {
  template: `<div style="display:flex;flex-direction:column;height:100%;min-height:12rem">
    <input v-model="wanted" placeholder="find a node" aria-label="find a node" style="border:1px solid #ccc;padding:.2rem .4rem;margin-bottom:.3rem">
    <div ref="list" @scroll="top = $refs.list.scrollTop" style="overflow:auto;flex:1;font:13px/20px ui-monospace,monospace" role="tree">
      <div :style="{height: rows.length * 20 + 'px', position: 'relative'}">
        <div v-for="row in in_sight" :key="row.node" @click="toggle(row)" role="treeitem"
             :style="{position:'absolute',top:row.at * 20 + 'px',left:row.depth * 16 + 'px',whiteSpace:'pre',cursor:row.inner ? 'pointer' : 'default',color:row.colour,fontWeight:row.bold ? 'bold' : 'normal'}"
             >{{ row.inner ? (row.open ? '▾' : '▸') : ' ' }}{{ row.sign }} {{ row.name }}<span v-if="row.said" style="color:#777"> — {{ row.said }}</span></div>
      </div>
    </div>
    <div v-if="!rows.length" style="color:#777">{{ nodes ? 'no node was reached' : 'no mission runs' }}</div>
  </div>`,
  props: { nodes: Array, cause: Number },
  data: () => ({ rows: [], top: 0, height: 600, wanted: "" }),
  computed: {
    in_sight() {
      const first = Math.max(0, Math.floor(this.top / ROW) - 5);
      return this.rows.slice(first, first + Math.ceil(this.height / ROW) + 10);
    },
  },
  watch: { wanted() { this.lay_out(); } },
  mounted() {
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
        if (parts.tree) { this.tree = parts.tree; this.children = this.family(parts.tree); this.opened.clear(); }
        if (parts.marks) this.marks = parts.marks;
        if (parts.tree || parts.marks) this.lay_out();
      })];
      return () => ceases.forEach((each) => each());
    },
    // Of a recorded run: how its nodes stand at the moment that is looked at.
    show_marks(marks) { this.marks = marks; this.lay_out(); },
    family(tree) {
      const children = tree.map(() => []);
      tree.forEach(([, parent], node) => { if (parent >= 0) children[parent].push(node); });
      return children;
    },
    toggle(row) {
      if (!row.inner) return;
      this.opened.set(row.node, !row.open); this.lay_out();
    },
    lay_out() {
      // A branch is open by itself while it runs, or when it failed and its parent did.
      const { statuses, said } = this.marks, rows = [], wanted = this.wanted.trim().toLowerCase();
      const found = new Set(), guilty = new Set();
      for (let each = this.cause ?? -1; each >= 0; each = this.tree[each][1]) guilty.add(each);
      if (wanted) {
        this.tree.forEach(([name], node) => {
          if (!name.toLowerCase().includes(wanted)) return;
          for (let each = node; each >= 0; each = this.tree[each][1]) found.add(each);
        });
      }
      const add = (node, depth) => {
        if (wanted && !found.has(node)) return;
        const status = statuses[node] || ".", inner = this.children[node].length > 0;
        const open = inner && (wanted ? true : this.opened.get(node) ?? (status === ">" || status === "x" || status === "-" || guilty.has(node)));
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
