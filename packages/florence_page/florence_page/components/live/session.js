// The session of NiceGUI, which serves dialogs and fields. NiceGUI reloads a page whose session its server does not know any more,
// and with it goes what is on the screen. Here the page stays as it is and says so; what does not need the session goes on.
export const LOST = "florence-session-lost";

function keep() {
  const socket = window.socket;
  if (!socket) { setTimeout(keep, 50); return; }
  const lost = () => {
    socket.disconnect(); document.getElementById("popup").ariaHidden = true; window.dispatchEvent(new Event(LOST));
  };
  for (const event of ["connect_error", "try_reconnect"]) socket.off(event);
  socket.on("try_reconnect", lost);
  // "timeout" and the like: socket.io tries again by itself.
  socket.on("connect_error", (error) => { if (error.message === "Implicit handshake failed") lost(); });
}

keep();
