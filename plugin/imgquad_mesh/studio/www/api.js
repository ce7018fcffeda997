// Talks to the server. Each page has an id of its own, which keys its session.

const tab = [...crypto.getRandomValues(new Uint8Array(16))].map((b) => b.toString(16).padStart(2, "0")).join("");

async function post(path, body, more = {}) {
  const answer = await fetch(path, { method: "POST", body, headers: { "X-Tab": tab }, ...more });
  if (!answer.ok) {
    const told = await answer.json().catch(() => ({ error: `the studio answered ${answer.status}` }));
    throw new Error(told.error);
  }
  return answer;
}

export const askOptions = async () => (await post("/options")).json();
export const askTexts = async (recipe) => (await post("/texts", JSON.stringify({ recipe }))).json();
export const givenPicture = async () => (await post("/given")).blob();
export const sendPicture = async (blob, name) => (await post(`/picture?name=${encodeURIComponent(name)}`, blob)).json();
export const sendMarks = (blob) => post("/marks", blob);
export const close = () => void post("/close", undefined, { keepalive: true }).catch(() => {});

// Runs a task: `tell` gets its stages; gives what it made and the bytes behind it. Aborting kills the work.
export async function run(task, signal, tell) {
  const reader = (await post("/do", JSON.stringify(task), { signal })).body.getReader();
  let rest = new Uint8Array();
  for (;;) {
    const end = rest.indexOf(10);
    if (end < 0) {
      const { done, value } = await reader.read();
      if (done) throw new Error("the studio broke off: try again");
      rest = joined([rest, value]);
      continue;
    }
    const line = JSON.parse(new TextDecoder().decode(rest.subarray(0, end)));
    rest = rest.subarray(end + 1);
    if (line.error) throw new Error(line.error);
    if (line.done) return [line.done, await bytes(reader, rest, line.bytes)];
    tell(line);
  }
}

// Reads so many bytes, and to the end: the server takes the next task when the answer is out.
async function bytes(reader, first, n) {
  const whole = new Uint8Array(n);
  let at = 0;
  for (let value = first, done = false; !done; { done, value } = await reader.read()) {
    whole.set(value, at);
    at += value.length;
  }
  if (at < n) throw new Error("the studio broke off: try again");
  return whole;
}

function joined(parts) {
  const whole = new Uint8Array(parts.reduce((n, part) => n + part.length, 0));
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return whole;
}

const TYPES = { uint8: Uint8Array, uint16: Uint16Array, uint32: Uint32Array, float32: Float32Array };

// The arrays behind an answer, by name.
export function arraysOf(done, data) {
  const found = {};
  let at = 0;
  for (const { name, type, shape, bytes } of done.arrays) {
    found[name] = Object.assign(new TYPES[type](data.buffer, data.byteOffset + at, bytes / TYPES[type].BYTES_PER_ELEMENT), { shape });
    at += bytes + ((4 - (bytes % 4)) % 4);
  }
  return found;
}

export function filesOf(done, data) {
  let at = 0;
  return done.files.map(({ name, bytes }) => new File([data.subarray(at, (at += bytes))], name));
}
