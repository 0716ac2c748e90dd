// Groups of things to choose from, with what each is: missions to be opened, nodes to be inserted.
export default {
  template: `<div style="display:flex;flex-direction:column;min-height:0;font:13px/1.4 sans-serif">
    <input v-model="wanted" :placeholder="hint" :aria-label="hint" style="border:1px solid #ccc;border-radius:6px;padding:.3rem .5rem;margin-bottom:.4rem">
    <div style="overflow:auto;flex:1 1 0;min-height:0">
      <template v-for="group in shown" :key="group.title">
        <div style="color:#777;font-size:11px;letter-spacing:.06em;text-transform:uppercase;margin:.5rem .2rem .15rem">{{ group.title }}</div>
        <div v-for="item in group.items" :key="item.name" role="button" tabindex="0" class="florence-choice" :data-name="item.name"
             @click="$emit('pick', {group: group.key, name: item.name})" @keydown.enter="$emit('pick', {group: group.key, name: item.name})"
             style="padding:.25rem .4rem;border-radius:6px;cursor:pointer"
             :style="{background: item.name === chosen ? '#e3ebf7' : 'transparent'}">
          <span style="font-weight:600">{{ item.name }}</span><span v-if="item.mark" style="color:#b07d00;font-size:11px"> {{ item.mark }}</span>
          <div style="color:#666;font-size:12px;overflow:hidden;display:-webkit-box;-webkit-line-clamp:2;-webkit-box-orient:vertical" :title="item.about">{{ item.about }}</div>
        </div>
      </template>
      <div v-if="!shown.length" style="color:#777;padding:.4rem">nothing is called so</div>
    </div>
  </div>`,
  props: { groups: Array, hint: String, chosen: String },
  data: () => ({ wanted: "" }),
  watch: {
    groups() {
      this.$nextTick(() => {
        const chosen = this.chosen && this.$el.querySelector(`[data-name="${this.chosen}"]`);
        if (chosen) chosen.scrollIntoView({ block: "nearest" });
      });
    },
  },
  computed: {
    shown() {
      const wanted = this.wanted.trim().toLowerCase();
      return (this.groups || []).map((group) => ({
        ...group, items: group.items.filter((each) => !wanted || (each.name + " " + each.about).toLowerCase().includes(wanted)),
      })).filter((group) => group.items.length);
    },
  },
};
