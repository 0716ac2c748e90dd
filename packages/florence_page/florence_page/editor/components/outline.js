// The drawing of a mission as an outline: a click shows the line of a node, and the node of the cursor's line is marked.
const COLOURS = {
  sequence: ["#e3ebf7", "#2f5d9b"], selector: ["#fdf0d0", "#94690a"], parallel: ["#ece2f7", "#6a45a3"],
  skill: ["#e0f2e4", "#2c7a40"], run: ["#d8eff2", "#1f6f7a"], fail: ["#fbe0dd", "#a83226"],
  if: ["#fbe6f0", "#a33a72"], switch: ["#fbe6f0", "#a33a72"], condition: ["#fbe6f0", "#a33a72"],
};
const OTHER = ["#efefef", "#5c5c5c"];

export default {
  template: `<div ref="all" style="overflow:auto;font:13px/1.4 sans-serif;padding:.25rem" role="tree" aria-label="drawing">
    <div v-if="!rows.length || stale" style="color:#777;padding:.3rem .6rem">{{ empty }}</div>
    <div v-for="(row, i) in rows" :key="i" role="treeitem" :aria-selected="i === at" @click="$emit('node', {line: row.line})"
         :style="{display:'flex',gap:'.4rem',alignItems:'baseline',cursor:'pointer',padding:'1px 4px',borderRadius:'6px',
                  contentVisibility:'auto',opacity: stale ? .45 : 1,background: i === at ? '#fff3c4' : 'transparent'}">
      <span v-for="n in row.depth" style="flex:none;width:.75rem;align-self:stretch;border-left:1px solid #ddd"></span>
      <span v-if="row.edge" style="flex:none;color:#777;font-size:11px">{{ row.edge }}</span>
      <span style="flex:none;border-radius:5px;padding:0 .45rem;border:1px solid"
            :style="{background: colours(row)[0], borderColor: colours(row)[1]}"><span v-if="row.sign" :style="{color: colours(row)[1]}">{{ row.sign }}&nbsp;</span>{{ row.title }}</span>
      <span v-if="row.details.length" style="color:#666;font-size:12px;min-width:0;overflow:hidden;text-overflow:ellipsis;white-space:nowrap" :title="row.details.join('\\n')">{{ row.details.join(' · ') }}</span>
    </div>
  </div>`,
  props: { rows: Array, line: Number, empty: String, stale: Boolean },
  computed: {
    at() {
      let found = -1;
      (this.rows || []).forEach((row, i) => { if (row.first <= this.line && (found < 0 || row.first >= this.rows[found].first)) found = i; });
      // Of nodes that begin in one line the outermost is meant.
      while (found > 0 && this.rows[found - 1].first === this.rows[found].first) found -= 1;
      return found;
    },
  },
  watch: {
    at() {
      this.$nextTick(() => {
        const row = this.$refs.all && this.$refs.all.querySelector('[aria-selected="true"]');
        if (row) row.scrollIntoView({ block: "nearest" });
      });
    },
  },
  methods: { colours(row) { return COLOURS[row.kind] || OTHER; } },
};
