// deploy/ names metrics, ports, keys and programs that live elsewhere: here they are compared with where they live.

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import test from 'node:test';
import { fileURLToPath } from 'node:url';

const ROOT = fileURLToPath(new URL('../../', import.meta.url));
const read = (path) => readFileSync(join(ROOT, path), 'utf8');

function files(path, wanted) {
  return readdirSync(join(ROOT, path)).flatMap((name) => {
    const below = `${path}/${name}`;
    if (statSync(join(ROOT, below)).isDirectory()) return name === 'target' || name === 'web' ? [] : files(below, wanted);
    return wanted.test(name) ? [below] : [];
  });
}

const deployed = () => files('deploy', /\.(ya?ml|json5?|service)$|^Dockerfile$/);

test('metrics that are looked at are recorded', () => {
  const source = files('services', /\.rs$/).map(read).join('\n');
  const recorded = new Set([...source.matchAll(/(?:counter|gauge|histogram)!\(\s*"(tryon_[a-z_]+)"/g)].map((m) => m[1]));
  const looked = [...files('deploy/grafana', /\.json$/), ...files('deploy/prometheus', /\.yml$/)]
    .flatMap((path) => [...read(path).matchAll(/\btryon_[a-z_]+/g)].map((m) => m[0].replace(/_(bucket|sum|count)$/, '')));
  assert.ok(looked.length > 5);
  for (const name of new Set(looked)) assert.ok(recorded.has(name), `${name} is recorded nowhere`);
});

/** `section.key` → default, as deploy/tryon.toml shows it (arrays of tables under their name). */
function defaults() {
  const keys = new Map();
  let section = '';
  for (const line of read('deploy/tryon.toml').split('\n')) {
    const head = line.match(/^\[\[?([\w.]+)\]\]?/);
    const pair = line.match(/^(\w+)\s*=\s*(.+?)\s*(#.*)?$/);
    if (head) section = head[1];
    else if (pair) keys.set(`${section}.${pair[1]}`, pair[2]);
  }
  return keys;
}

test('environment variables are keys of the configuration', () => {
  const keys = defaults();
  let seen = 0;
  for (const path of deployed()) {
    for (const [, variable] of read(path).matchAll(/\b(TRYON_\w+?__\w+)\b/g)) {
      const key = variable.slice('TRYON_'.length).toLowerCase().replace('__', '.');
      assert.ok(keys.has(key), `${path}: ${variable} is no key`);
      seen += 1;
    }
  }
  assert.ok(seen > 10);
});

test('ports are those of the default configuration', () => {
  const keys = defaults();
  const port = (key) => keys.get(key).match(/:(\d+)"/)[1];
  for (const service of ['capture', 'tracking', 'cloth', 'compositor']) {
    const base = read(`deploy/kustomize/base/${service}.yaml`);
    for (const key of [`${service}.address`, `${service}.admin`]) assert.ok(base.includes(`containerPort: ${port(key)} `), key);
    assert.ok(read('deploy/prometheus/prometheus.yml').includes(`${service}:${port(`${service}.admin`)}"`));
    assert.ok(read('deploy/compose.yaml').includes(`/127.0.0.1/${port(`${service}.admin`)} `));
  }
  const bus = port('bus.listen');
  for (const path of ['deploy/zenoh/router.json5', 'deploy/compose.yaml', 'deploy/kustomize/base/capture.yaml']) {
    assert.ok(read(path).includes(bus), path);
  }
});

test('programs that are started are built', () => {
  for (const program of ['capture', 'tracking', 'cloth', 'compositor']) {
    assert.ok(existsSync(join(ROOT, `services/${program}/src/main.rs`)), `tryon-${program} has no main.rs`);
    assert.ok(read(`services/${program}/Cargo.toml`).includes(`name = "tryon-${program}"`));
    assert.ok(read(`deploy/systemd/tryon-${program}.service`).includes(`ExecStart=/usr/bin/tryon-${program} `));
  }
});

test('a pod gets no variables that the configuration would refuse', () => {
  for (const path of files('deploy/kustomize', /\.yaml$/)) {
    const text = read(path);
    if (/^kind: Deployment$/m.test(text)) assert.match(text, /enableServiceLinks: false/, path);
  }
});

test('the store overlay carries the router’s configuration as it is', () => {
  assert.equal(read('deploy/kustomize/overlays/store/router.json5'), read('deploy/zenoh/router.json5'));
});

test('the kiosk opens the page with its token, and without one where there is none', () => {
  const unit = read('deploy/systemd/tryon-kiosk.service').replaceAll('\\\n', '');
  const [, quoted] = unit.match(/^ExecStartPre=\/bin\/sh -ec "(.*)"$/m);
  const script = quoted.replaceAll('\\"', '"').replaceAll('$$', '$');
  assert.match(unit, /^ExecStart=.* file:\/\/\/run\/tryon-kiosk\/start\.html$/m);
  assert.match(unit, /^RuntimeDirectory=tryon-kiosk$/m);

  const folder = mkdtempSync(join(tmpdir(), 'kiosk-'));
  try {
    const env = { PATH: process.env.PATH, CREDENTIALS_DIRECTORY: folder, RUNTIME_DIRECTORY: folder };
    for (const [token, fragment] of [['\n', ''], ['aB-1._x.y\n', '#token=aB-1._x.y'], ['a"><b>\n', '#token=ab']]) {
      writeFileSync(join(folder, 'kiosk.token'), token);
      execFileSync('/bin/sh', ['-ec', script], { env });
      const page = readFileSync(join(folder, 'start.html'), 'utf8');
      assert.equal(page, `<meta http-equiv=refresh content="0;url=http://127.0.0.1:8080/${fragment}">\n`);
    }
  } finally {
    rmSync(folder, { recursive: true });
  }
});
