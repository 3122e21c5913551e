// node bundle.mjs FROM MODULES OUT: makes one file of main.js and what it imports (npm's packages from MODULES, scene-wire from OUT), without
// what nothing uses. Leaves in the folder OUT: kSceneBundle.cpp, a C++ source with that file, packed by gzip; bundled.json, the packages that are in it;
// copyright, Debian's file about whose work it is.
import {createRequire} from 'node:module';
import {readFileSync, writeFileSync} from 'node:fs';
import {resolve} from 'node:path';
import {gzipSync} from 'node:zlib';

const [from, modules, out] = process.argv.slice(2).map(path => resolve(path));
const {build} = createRequire(`${modules}/package.json`)('esbuild');
const {
  outputFiles: [bundle],
  metafile,
} = await build({
  entryPoints: [`${from}/main.js`],
  bundle: true,
  minify: true,
  format: 'esm',
  target: 'es2022',
  legalComments: 'eof',
  charset: 'utf8',
  alias: {'scene-wire': `${out}/scene-wire.js`},
  nodePaths: [`${modules}/node_modules`],
  write: false,
  metafile: true,
  logLevel: 'warning',
});
const packed = gzipSync(bundle.contents, {level: 9});
packed[9] = 255; // the system on which it was packed: unknown, so that it is the same everywhere
const lines = [];
for (let i = 0; i < packed.length; i += 32) lines.push([...packed.subarray(i, i + 32)].join(','));
writeFileSync(
  `${out}/kSceneBundle.cpp`,
  `#include <cstddef>
namespace phantom::synthetic_viewer::assets {
extern const unsigned char kSceneBundle[];
extern const std::size_t kSceneBundleBytes;
const unsigned char kSceneBundle[] = {
${lines.join(',\n')}};
const std::size_t kSceneBundleBytes = sizeof kSceneBundle;
}
`,
);

// The packages of which something is in the file.
const [written] = Object.values(metafile.outputs);
const names = Object.entries(written.inputs)
  .filter(([, {bytesInOutput}]) => bytesInOutput > 0)
  .map(([path]) => path.match(/node_modules\/((?:@[^/]+\/)?[^/]+)/)?.[1])
  .filter(Boolean);
const packages = [...new Set(names)].sort().map(name => {
  const folder = `${modules}/node_modules/${name}`,
    {version, license, homepage} = JSON.parse(readFileSync(`${folder}/package.json`, 'utf8'));
  const text = readFileSync(`${folder}/LICENSE`, 'utf8').replaceAll('\r', '').trim();
  return {name, version, license, homepage, text};
});
writeFileSync(
  `${out}/bundled.json`,
  JSON.stringify(
    packages.map(({text, ...known}) => known),
    null,
    1,
  ) + '\n',
);
writeFileSync(
  `${out}/copyright`,
  `Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: phantom

Files: *
Copyright: 2026 The Phantom authors
License: Apache-2.0
 On Debian systems the text is in /usr/share/common-licenses/Apache-2.0.
${packages
  .map(
    ({name, version, license, text}) => `
Files: (in the executable) what the operator's page takes from ${name} ${version}
Copyright: ${text.match(/^Copyright\s+(.+)$/im)?.[1] ?? `the authors of ${name}`}
License: ${license}
${text
  .split('\n')
  .map(line => (line.trim() ? ` ${line}` : ' .'))
  .join('\n')}
`,
  )
  .join('')}`,
);
