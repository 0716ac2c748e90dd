// The live stream: one WebSocket for the whole page. After a break it comes back by itself.
const listeners = new Set();
const parts = {};
let socket = null;
const states = new Set();

function connect() {
  socket = new WebSocket(new URL("live", location.href.replace(/^http/, "ws").replace(/[?#].*$/, "")));
  socket.onopen = () => states.forEach((each) => each(true));
  socket.onmessage = (event) => {
    const news = JSON.parse(event.data);
    Object.assign(parts, news);
    listeners.forEach((each) => each(news));
    socket.send("ok");
  };
  socket.onclose = () => {
    states.forEach((each) => each(false));
    socket = null;
    if (listeners.size) setTimeout(() => socket || connect(), 1000);
  };
}

export const live = {
  // Call back with the parts that changed, at first with all that are known; gives what ends it.
  listen(take) {
    listeners.add(take);
    if (!socket) connect();
    else take({ ...parts });
    return () => { listeners.delete(take); };
  },
  // Call back with whether the stream is there.
  on_state(tell) { states.add(tell); return () => states.delete(tell); },
};
