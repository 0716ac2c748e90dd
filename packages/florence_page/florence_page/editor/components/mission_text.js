// The text of a mission: CodeMirror with the words of missions, what is wrong at its place, and a list of it below.
import * as CM from "nicegui-codemirror";

const QUIET_MS = 350; // so long nothing is typed before the text is looked at
const COLOURS = { error: "#b3261e", warning: "#b07d00" };
const WORD = /^[\w.$-]+/;

class Sign extends CM.GutterMarker {
  constructor(severity) { super(); this.severity = severity; }
  eq(other) { return other.severity === this.severity; }
  toDOM() {
    const dot = document.createElement("span");
    dot.textContent = this.severity === "error" ? "✗" : "!";
    dot.style.cssText = `color:${COLOURS[this.severity]};font-weight:bold;padding:0 3px`;
    return dot;
  }
}

const set_marks = CM.StateEffect.define();
const marks = CM.StateField.define({
  create: () => [],
  update(value, transaction) {
    for (const effect of transaction.effects) if (effect.is(set_marks)) return effect.value;
    if (!transaction.docChanged) return value;
    return value.map((each) => ({
      ...each, from: transaction.changes.mapPos(each.from), to: transaction.changes.mapPos(each.to, 1),
    }));
  },
  provide: (field) => CM.EditorView.decorations.from(field, (value) => CM.Decoration.set(
    value.map((each) => CM.Decoration.mark({ class: `florence-${each.severity}` }).range(each.from, Math.max(each.to, each.from + 1)))
      .filter((each) => each.to > each.from), true)),
});
const signs = CM.gutter({
  class: "florence-signs",
  lineMarker(view, line) {
    const here = view.state.field(marks).filter((each) => each.from >= line.from && each.from <= line.to);
    if (!here.length) return null;
    return new Sign(here.some((each) => each.severity === "error") ? "error" : "warning");
  },
  lineMarkerChange: (update) => update.docChanged || update.startState.field(marks) !== update.state.field(marks),
  initialSpacer: () => new Sign("error"),
});
const told = CM.hoverTooltip((view, position) => {
  const here = view.state.field(marks).filter((each) => each.from <= position && position <= each.to + 1);
  if (!here.length) return null;
  return {
    pos: here[0].from, above: true,
    create() {
      const dom = document.createElement("div");
      dom.style.cssText = "max-width:32rem;padding:.3rem .5rem;font:13px/1.4 sans-serif";
      dom.textContent = here.map((each) => each.message).join("\n");
      return { dom };
    },
  };
});
const look = CM.EditorView.theme({
  "&": { height: "100%", fontSize: "13px" },
  ".cm-scroller": { overflow: "auto", fontFamily: "ui-monospace, 'DejaVu Sans Mono', monospace" },
  ".cm-gutters": { background: "#fafafa", border: "none" },
  "&.cm-focused": { outline: "none" },
  ".florence-error": { textDecoration: "underline wavy #b3261e", textUnderlineOffset: "3px" },
  ".florence-warning": { textDecoration: "underline wavy #b07d00", textUnderlineOffset: "3px" },
});

// A new line goes on in the block of the one above; behind a key without a value it begins a deeper one.
function indent_after(context, position) {
  const above = context.lineAt(position, -1).text;
  const start = /^ *(?:- +)*/.exec(above)[0].length;
  return /:\s*$/.test(above) ? start + 2 : start;
}

export default {
  template: `<div style="display:flex;flex-direction:column;min-height:0">
    <div ref="text" data-florence="text" style="flex:1 1 0;min-height:8rem;overflow:hidden"></div>
    <div role="log" aria-label="findings" style="flex:none;max-height:34%;overflow:auto;border-top:1px solid #e0e0e0;font:13px/1.45 sans-serif">
      <div v-if="restored" style="padding:.35rem .6rem;background:#fff8e1">your text of {{ restored }}, which was not saved
        <button @click="throw_away" style="text-decoration:underline">throw it away</button></div>
      <div v-if="note" style="padding:.35rem .6rem;color:#666">{{ note }}</div>
      <div v-for="each in shown" @click="go_to(each.line, each.column)" class="florence-finding"
           :style="{padding:'.3rem .6rem',cursor:'pointer',borderLeft:'3px solid ' + colour(each),borderBottom:'1px solid #f0f0f0'}">
        <span :style="{color: colour(each), fontWeight: 'bold'}">{{ each.file ? each.file + ' ' : '' }}line {{ each.line }}</span>
        {{ each.message }}
        <div v-if="each.valid.length" style="color:#555">what works:
          <template v-for="(word, i) in each.valid">{{ i ? ', ' : '' }}<a v-if="mends(each, word)" href="#" @click.prevent.stop="mend(each, word)"
            :title="'write ' + word + ' there'" style="color:#1f6fd6;text-decoration:underline">{{ word }}</a><span v-else>{{ word }}</span></template>
        </div>
      </div>
    </div>
  </div>`,
  props: { text: String, findings: Array, note: String, dirty: Boolean, most: Number },
  computed: { shown() { return (this.findings || []).slice(0, 100); } },
  data: () => ({ restored: "" }),
  watch: {
    findings() { this.mark(); },
    dirty(now, before) { if (before && !now) this.forget(); }, // saved
  },
  async mounted() {
    const language = new CM.Compartment();
    const words = [{ autocomplete: (context) => this.complete(context) }]; // another function would be asked anew
    const kept = JSON.parse(localStorage.getItem(this.key()) || "null");
    this.editor = new CM.EditorView({
      doc: kept ? kept.text : this.text || "",
      parent: this.$refs.text,
      extensions: [
        CM.Prec.high(CM.keymap.of([{ key: "Mod-s", run: () => { this.tell(); this.$emit("save"); return true; }, preventDefault: true }])),
        CM.basicSetup, signs, marks, told, look, language.of([]),
        CM.indentUnit.of("  "), CM.indentService.of(indent_after), CM.keymap.of([CM.indentWithTab]), CM.EditorView.lineWrapping,
        CM.EditorView.contentAttributes.of({ "aria-label": "mission", autocapitalize: "off", spellcheck: "false" }),
        CM.EditorView.domEventHandlers({ blur: () => { if (this.due) this.tell(); } }), // a button is pressed next
        CM.EditorState.languageData.of(() => words),
        CM.EditorView.updateListener.of((update) => {
          if (update.docChanged) this.changed();
          if (update.selectionSet || update.docChanged) this.moved();
        }),
      ],
    });
    this.line = 1;
    this.leaving = (event) => { if (this.dirty) event.preventDefault(); };
    window.addEventListener("beforeunload", this.leaving);
    this.mark();
    if (kept) { this.restored = new Date(kept.at).toLocaleString(); this.tell(); }
    const yaml = CM.languages.find((each) => each.name === "YAML");
    if (yaml) this.editor.dispatch({ effects: language.reconfigure(await yaml.load()) });
  },
  unmounted() { clearTimeout(this.due); window.removeEventListener("beforeunload", this.leaving); this.editor.destroy(); },
  methods: {
    colour(finding) { return COLOURS[finding.severity]; },
    changed() { clearTimeout(this.due); this.due = setTimeout(() => this.tell(), QUIET_MS); },
    tell() {
      clearTimeout(this.due);
      this.due = 0;
      // Of one that is too long enough to be refused: it is no mission, and is not to be lost for one.
      const text = this.editor.state.doc.toString();
      if (text === this.text) this.forget();
      else localStorage.setItem(this.key(), JSON.stringify({ text, at: Date.now() }));
      this.$emit("text", { text: text.slice(0, this.most + 1) });
    },
    // What was not saved is kept in the browser: neither a server that is started again nor a closed page loses it.
    key() { return `florence_text ${location.pathname}`; },
    forget() { localStorage.removeItem(this.key()); this.restored = ""; },
    throw_away() { this.set_text(this.text || ""); this.forget(); },
    moved() {
      const line = this.editor.state.doc.lineAt(this.editor.state.selection.main.head).number;
      if (line === this.line) return;
      this.line = line; this.$emit("line", { line });
    },
    // A column counts characters, CodeMirror counts halves of those beyond the first plane.
    place(number, column) {
      const doc = this.editor.state.doc, line = doc.line(Math.min(Math.max(1, number), doc.lines));
      return Math.min(line.to, line.from + [...line.text].slice(0, column - 1).join("").length);
    },
    word_at(from) {
      const line = this.editor.state.doc.lineAt(from), found = WORD.exec(line.text.slice(from - line.from));
      return found ? found[0] : "";
    },
    mark() {
      if (!this.editor) return;
      const value = (this.findings || []).filter((each) => !each.file).map((each) => {
        const from = this.place(each.line, each.column), line = this.editor.state.doc.lineAt(from);
        return { ...each, from, to: from + (this.word_at(from).length || line.to - from) };
      });
      this.editor.dispatch({ effects: set_marks.of(value) });
    },
    mends(finding, word) {
      if (finding.file || !/^[\w.$-]+$/.test(word) || !this.editor) return false;
      return this.word_at(this.place(finding.line, finding.column)) !== "";
    },
    mend(finding, word) {
      const from = this.place(finding.line, finding.column);
      this.editor.dispatch({ changes: { from, to: from + this.word_at(from).length, insert: word }, selection: { anchor: from + word.length }, userEvent: "input" });
      this.editor.focus(); this.tell();
    },
    async complete(context) {
      const line = context.state.doc.lineAt(context.pos), before = line.text.slice(0, context.pos - line.from);
      if (!context.explicit && !/([\w$°]|[:{,] )$/.test(before)) return null;
      const column = [...before].length + 1;
      const answer = await fetch("complete", {
        method: "POST", headers: { "content-type": "application/json" },
        body: JSON.stringify({ text: context.state.doc.toString(), line: line.number, column }),
      });
      if (!answer.ok) return null;
      const { from, options } = await answer.json();
      if (!options.length) return null;
      return {
        from: this.place(line.number, from), filter: false,
        options: options.map((each) => ({ label: each.label, apply: each.apply, info: each.about || undefined })),
      };
    },
    // ---- called from Python ----
    go_to(line, column) {
      const anchor = this.place(line, column || 1);
      this.editor.dispatch({ selection: { anchor }, effects: CM.EditorView.scrollIntoView(anchor, { y: "center" }) });
      this.editor.focus();
    },
    set_text(text) {
      this.editor.dispatch({ changes: { from: 0, to: this.editor.state.doc.length, insert: text } }); this.tell();
    },
    insert(after, lines) {
      const doc = this.editor.state.doc, line = doc.line(Math.min(after, doc.lines));
      this.editor.dispatch({
        changes: { from: line.to, insert: "\n" + lines }, userEvent: "input",
        selection: { anchor: line.to + 1 + lines.length }, scrollIntoView: true,
      });
      this.editor.focus(); this.tell();
    },
  },
};
