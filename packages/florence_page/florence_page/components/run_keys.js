// The keys of florence replay, for the page of a recorded run. The slider has its own when it has the focus.
const KEYS = ["ArrowLeft", "ArrowRight", "PageUp", "PageDown", "Home", "End", "f", "F", "g", "G"];

export default {
  template: "<span></span>",
  emits: ["go"],
  mounted() {
    this.take = (event) => {
      const busy = event.target.closest && event.target.closest("input, textarea, [contenteditable], [role=slider]");
      if (busy && !/^[a-z]$/i.test(event.key) || event.target.matches?.("input, textarea")) return;
      if (!KEYS.includes(event.key) || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault(); this.$emit("go", event.key);
    };
    window.addEventListener("keydown", this.take);
  },
  unmounted() { window.removeEventListener("keydown", this.take); },
};
