// The live stream: one WebSocket for the whole page. After a break it comes back by itself.
const listeners = new Set();
const parts = {};
let socket = null;
const states = new Set();

function connect() {
  socket = new WebSocket(new URL("live", location.href.replace(/^http/, "ws").replace(/[?#].*$/, "")));
  socket.onopen = () => { tell_wants(); states.forEach((each) => each(true)); };
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

// What the map, the tree and others want to see of what comes often; how many of them.
const wants = new Map();

function tell_wants() { live.send(`want ${[...wants.keys()].join(" ")}`); }

export const live = {
  // Say something to the robot; lost when the stream is not there.
  send(text) { if (socket && socket.readyState === WebSocket.OPEN) socket.send(text); },
  // Ask for what is shown on request; gives what ends it.
  want(name) {
    wants.set(name, (wants.get(name) || 0) + 1); tell_wants();
    return () => {
      if (wants.get(name) > 1) wants.set(name, wants.get(name) - 1); else wants.delete(name);
      tell_wants();
    };
  },
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
