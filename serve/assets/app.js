// Starts the page: its parts, its views, its keys, and what it shows of the connection.

import { byId, setAttribute, setText, show } from "./dom.js";
import { connect, http, on } from "./connection.js";
import { startEvents } from "./events.js";
import { startFaults } from "./faults.js";
import { startHand } from "./hand.js";
import { startJobs } from "./jobs.js";
import { startJog } from "./jog.js";
import { startLatency } from "./latency.js";
import { startMap } from "./map.js";
import { startQueue } from "./queue.js";
import { announce, lock, startRequests } from "./requests.js";
import { startScope } from "./scope.js";
import { BY_HAND, startStatus, status } from "./status.js";
import { startTheme } from "./theme.js";

const VIEWS = ["operate", "jobs", "scope", "latency", "events"];

/** Shows one view, and says in the address which. */
function showView(name, isFocused = false) {
  const view = VIEWS.includes(name) ? name : VIEWS[0];
  for (const each of VIEWS) {
    const tab = byId(`tab-${each}`);
    const isShown = each === view;
    setAttribute(tab, "aria-selected", isShown);
    tab.tabIndex = isShown ? 0 : -1;
    show(byId(`view-${each}`), isShown);
    if (isShown && isFocused) tab.focus();
  }
  if (location.hash !== `#${view}`) history.replaceState(null, "", `#${view}`);
  window.dispatchEvent(new CustomEvent("viewshown", { detail: view }));
}

function startViews() {
  VIEWS.forEach((view, index) => {
    const tab = byId(`tab-${view}`);
    tab.addEventListener("click", () => showView(view));
    tab.addEventListener("keydown", (event) => {
      const next = { ArrowRight: index + 1, ArrowLeft: index - 1, Home: 0, End: VIEWS.length - 1 }[event.key];
      if (next === undefined) return;
      event.preventDefault();
      showView(VIEWS[(next + VIEWS.length) % VIEWS.length], true);
    });
  });
  window.addEventListener("hashchange", () => showView(location.hash.slice(1)));
  showView(location.hash.slice(1));
}

/** Keys that work anywhere but where somebody types. */
function startKeys() {
  const isOn = byId("keys-on");
  isOn.checked = localStorage.getItem("graver.keys") !== "off";
  isOn.addEventListener("change", () => localStorage.setItem("graver.keys", isOn.checked ? "on" : "off"));
  const help = byId("help");
  // Hold and stop stay within reach while the help is open.
  const toggleHelp = () => (help.open ? help.close() : help.show());
  byId("help-open").addEventListener("click", toggleHelp);
  const hold = () => byId(BY_HAND.includes(status()?.state) ? "stop" : "hold").click();
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.repeat || event.defaultPrevented) return;
    if (byId("login").open) return;
    if (event.key === "Escape") {
      if (help.open) help.close();
      else hold();
      return;
    }
    const isTyping = event.target.closest("input:not([type=range], [type=checkbox]), textarea, select");
    if (isTyping || !isOn.checked) return;
    if (event.shiftKey && event.code === "KeyS") byId("stop").click();
    else if (event.shiftKey && event.code === "KeyR") byId("resume").click();
    else if (event.key === "h") hold();
    else if (event.key === "?") toggleHelp();
    else if (VIEWS[Number(event.key) - 1]) showView(VIEWS[Number(event.key) - 1], true);
    else return;
    event.preventDefault();
  });
}

function showBanner(title, text) {
  lock(true);
  setText(byId("banner-title"), title);
  setText(byId("banner-text"), text);
  show(byId("banner"), true);
}

function showLink({ open, wasOpen }) {
  document.body.dataset.link = open ? "open" : "lost";
  setText(byId("link-word"), open ? "live" : "connecting…");
  if (open) {
    show(byId("banner"), false);
    return;
  }
  showBanner("No connection.", "What is shown is old, and nothing can be operated from here. The machine goes on by itself: stop it at the machine. Trying again…");
  if (wasOpen) announce("The connection is lost", true);
  http("GET", "status").catch((error) => {
    if (error.status === 401 && !byId("login").open) byId("login").showModal();
  });
}

function startLink() {
  on("link", showLink);
  on("hello", ({ role, machine }) => {
    const operatesNow = role === "operate";
    document.body.dataset.role = operatesNow ? "operate" : "watch";
    show(byId("role-word"), !operatesNow);
    setText(byId("machine-name"), machine.name ?? "Graver");
    setText(byId("machine-kind"), `${machine.mechanism ?? ""}${machine.simulated ? ", simulated" : ""}`);
    if (byId("login").open) byId("login").close();
    lock(!operatesNow);
  });
  let isSilent = false;
  on("silent", ({ error }) => {
    isSilent = true;
    document.body.dataset.link = "silent";
    showBanner("The pipeline does not answer.", `${error ?? ""} What is shown is old; this page goes on when it answers again.`);
  });
  on("status", () => {
    if (!isSilent) return;
    isSilent = false;
    document.body.dataset.link = "open";
    show(byId("banner"), false);
    lock(document.body.dataset.role !== "operate");
  });
}

startTheme();
startViews();
startKeys();
startRequests();
startLink();
startStatus();
startHand();
startJog();
startMap();
startQueue();
startJobs();
startScope();
startLatency();
startEvents();
startFaults();
connect();
