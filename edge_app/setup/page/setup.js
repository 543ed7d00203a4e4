// The page of `alidade setup`: searches, shows what was found, writes the configuration. The token
// is behind the # of the address, which a browser sends to nobody.

const token = location.hash.slice(1);
const element = (id) => document.getElementById(id);
let chosen = null;

async function ask(what, body) {
  const answer = await fetch(`/api/v1/setup/${what}`, {
    method: 'POST',
    headers: {'Authorization': `Bearer ${token}`, 'Content-Type': 'application/json'},
    body: JSON.stringify(body),
  });
  const json = await answer.json();
  if (!answer.ok) throw new Error(json.error);
  return json;
}

function line(text, name = 'p') {
  const made = document.createElement(name);
  made.textContent = text;
  return made;
}

function streamText(stream) {
  const told = (value, unit) => value === null ? `${unit} not told` : `${value} ${unit}`;
  const size = stream.width === null ? 'size not told' : `${stream.width}x${stream.height}`;
  const frames = stream.b_frames === null ? 'B-frames not told'
    : stream.b_frames ? 'B-frames possible' : 'no B-frames';
  return [`${size} ${stream.codec ?? ''} ${stream.profile ?? ''}`.trim(), told(stream.rate_hz, 'Hz'),
    `key frame: ${told(stream.key_frame_distance, 'pictures')}`, frames].join(', ');
}

function telemetryText(telemetry) {
  if (telemetry.type === null) return 'pan and tilt: none';
  if (telemetry.answers === null) return `pan and tilt: ${telemetry.type}, not asked: it wants a login`;
  if (!telemetry.answers) {
    const how = telemetry.error.includes('pan_range_deg') ? 'in units of its own' : 'no answer';
    return `pan and tilt: ${telemetry.type}, ${how}: ${telemetry.error}`;
  }
  return `pan ${telemetry.pan_deg.toFixed(2)} deg, tilt ${telemetry.tilt_deg.toFixed(2)} deg (${telemetry.type})`;
}

function choose(device, name) {
  chosen = device;
  element('chosen').textContent = `${name}, ${device}`;
  element('said').textContent = '';
  element('setup').hidden = false;
  element('setup').scrollIntoView();
}

function card(title, device) {
  const made = document.createElement('section');
  made.append(line(title, 'h2'));
  const button = line('Take this one', 'button');
  button.type = 'button';
  button.onclick = () => choose(device, title);
  return {made, button};
}

function cameraCard(camera) {
  const {made, button} = card(camera.name, camera.vapix ?? camera.onvif);
  made.append(line(camera.host));
  camera.streams.forEach((stream, index) => {
    const taken = index === camera.take;
    const remark = taken ? camera.reason : stream.remark;
    made.append(line(`${taken ? 'take' : 'stream'}: ${streamText(stream)}${remark ? ` (${remark})` : ''}`));
  });
  made.append(line(telemetryText(camera.telemetry)));
  if (camera.error) made.append(line(camera.error));
  for (const note of camera.notes) made.append(line(note));
  made.append(button);
  return made;
}

function videoCard(device) {
  const {made, button} = card(device.name ?? device.node, device.node);
  made.append(line(device.device));
  const best = device.modes[0];
  if (best) made.append(line(`take: ${best.format} ${best.width}x${best.height}`));
  made.append(device.error ? line(device.error) : button);
  return made;
}

function show(found) {
  const cards = [...found.cameras.map(cameraCard), ...found.video_devices.map(videoCard)];
  for (const port of found.serial_ports)
    cards.push(line(`serial port ${port.device}${port.name ? `, ${port.name}` : ''}`));
  for (const note of found.notes) cards.push(line(note));
  element('found').replaceChildren(...(cards.length > 0 ? cards : [line('Nothing was found. A search reaches this machine\'s own networks only.')]));
}

// Runs while all buttons wait.
async function busy(where, text, work) {
  const buttons = [...document.querySelectorAll('button')];
  for (const button of buttons) button.disabled = true;
  where.textContent = text;
  try {
    where.textContent = await work();
  } catch (error) {
    where.textContent = error.message;
  }
  for (const button of buttons) button.disabled = false;
}

const login = () => ({user: element('user').value, password: element('password').value});

element('search').onclick = () => busy(element('searching'), 'searching ...', async () => {
  show(await ask('search', {}));
  return '';
});
element('add').onclick = () => {
  const address = element('address').value.trim();
  if (address) choose(address, 'camera');
};
element('look').onclick = () => busy(element('said'), 'asking the camera ...', async () => {
  show(await ask('search', {device: chosen, ...login()}));
  return 'The list above has what it says.';
});
element('setup').onsubmit = (event) => {
  event.preventDefault();
  const keys = element('keys').value.split('\n').map((key) => key.trim()).filter((key) => key);
  if (element('pan').value) keys.push(`pan_tilt.pan_range_deg=[${element('pan').value}]`);
  if (element('tilt').value) keys.push(`pan_tilt.tilt_range_deg=[${element('tilt').value}]`);
  busy(element('said'), 'trying video and pan and tilt ...', async () => {
    const done = await ask('write', {device: chosen, ...login(), field_of_view: element('field').value.trim(),
      head: element('head').value.trim(), keys});
    element('password').value = '';
    return [...done.remarks, `Written: ${done.path}. Next, in the terminal: alidade check -c ${done.path}`].join(' ');
  });
};
ask('start', {}).then((start) => { element('file').textContent = start.path; },
  (error) => { element('searching').textContent = error.message; });
