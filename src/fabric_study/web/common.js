// SPDX-License-Identifier: BSD-3-Clause
// What both pages need: building elements, asking the server, hearing from it.

const SILENCE = 4000; // ms without a word after which the connection counts as lost
const RETRY = 700; // ms between attempts

/** An element with attributes (`on...`: listeners, `data`: data attributes) and children. */
export function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "data") Object.assign(element.dataset, value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

/** The server said no; the message is its sentence. */
export class Refusal extends Error {
  constructor(sentence, status) {
    super(sentence);
    this.status = status;
  }
}

function cookie(name) {
  const found = document.cookie.split("; ").find((entry) => entry.startsWith(`${name}=`));
  return found ? found.slice(name.length + 1) : "";
}

/** POST a request; what it answers. Throws Refusal, or another error when nobody answers. */
export async function ask(name, fields = {}) {
  const response = await fetch(`/api/${name}`, {
    method: "POST",
    headers: { "Content-Type": "application/json", "X-XSRFToken": cookie("_xsrf") },
    body: JSON.stringify(fields),
  });
  const content = await response.json();
  if (!response.ok) throw new Refusal(content.error, response.status);
  return content.answer;
}

/** Calls take(sections) with all that is known whenever something changes, and connected(bool). */
export function follow(path, take, connected) {
  let sections = {};
  let timer = 0;
  let told = null;
  const tell = (state) => {
    if (state !== told) connected((told = state));
  };
  const open = () => {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live/${path}`);
    let whole = true; // the first message holds everything
    const lose = () => {
      clearTimeout(timer);
      socket.onmessage = socket.onclose = null;
      socket.close();
      tell(false);
      setTimeout(open, RETRY);
    };
    const listen = () => {
      clearTimeout(timer);
      timer = setTimeout(lose, SILENCE);
    };
    socket.onmessage = (event) => {
      listen();
      const news = JSON.parse(event.data);
      sections = whole ? news : { ...sections, ...news };
      const changed = whole || Object.keys(news).length > 0;
      whole = false;
      tell(true);
      if (changed) take(sections, news);
    };
    socket.onclose = lose;
    listen();
  };
  open();
}
