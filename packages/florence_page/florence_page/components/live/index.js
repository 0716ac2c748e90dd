// The live streams: one WebSocket for the robot, and on the editor's page one for the trial. After a break a stream comes back
// by itself; what it brought stays, and whoever shows it is told how old it is.
import "./session.js";

const SILENT_MS = 1500, GIVE_UP_MS = 4000, AGAIN_MS = 500, LOOK_MS = 250;

function make_stream(path) {
  const listeners = new Set(), states = new Set(), parts = {}, wants = new Map();
  let socket = null, since = performance.now(), silent = false, beat = null, watching = 0;

  function connect() {
    const mine = new WebSocket(new URL(path, location.href.replace(/^http/, "ws").replace(/[?#].*$/, "")));
    socket = mine;
    mine.begun = performance.now();
    mine.onopen = () => tell_wants();
    mine.onmessage = (event) => {
      if (mine !== socket) return;
      const { beat: newest, ...news } = JSON.parse(event.data);
      beat = newest; since = performance.now();
      look();
      mine.send("ok");
      if (!Object.keys(news).length) return;
      Object.assign(parts, news);
      listeners.forEach((each) => each(news));
    };
    mine.onclose = () => { if (mine === socket) { socket = null; if (listeners.size) setTimeout(() => socket || connect(), AGAIN_MS); } };
    if (!watching) watching = setInterval(look, LOOK_MS);
  }

  // A line that brings nothing is given up: one that a proxy holds would not close for minutes.
  function look() {
    const now = performance.now(), was = silent;
    silent = now - since > SILENT_MS;
    if (silent || was) states.forEach((each) => each(stream.age_s()));
    if (socket && now - Math.max(since, socket.begun) > GIVE_UP_MS) { const lost = socket; socket = null; lost.close(); connect(); }
  }

  function tell_wants() { stream.send(`want ${[...wants.keys()].join(" ")}`); }

  const stream = {
    // Say something to the robot; lost when the stream is not there.
    send(text) { if (socket && socket.readyState === WebSocket.OPEN) socket.send(text); },
    // What a press says beside itself: the beat that was on the screen, and for how many seconds.
    press() { return { beat, age: (performance.now() - since) / 1000 }; },
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
    // Seconds for which nothing has come; 0 while news come.
    age_s() { return silent ? (performance.now() - since) / 1000 : 0; },
    // Call back with the age of what is shown, again and again while it is old; gives what ends it.
    on_age(tell) { states.add(tell); tell(stream.age_s()); return () => states.delete(tell); },
  };
  return stream;
}

// The stream of what a page shows, and that of the robot; mostly they are the same.
export const live = make_stream("live");
export const robot = new URL("live", location.href).pathname === "/live" ? live : make_stream("/live");
// What is old is grey: what the page shows, and of what it shows that of somebody who says nothing.
let mute = {};
function show_age() {
  const old = Object.keys(mute);
  if (robot.age_s()) old.push("page");
  if (document.documentElement.dataset.old !== old.join(" ")) document.documentElement.dataset.old = old.join(" ");
}
robot.on_age(show_age);
robot.listen(({ silent }) => { if (silent) { mute = silent; show_age(); } });

// For buttons of NiceGUI: what the server judges a press by.
window.florence_press = () => robot.press();
