// The modules of the scene, with what it is bundled with: PHANTOM_SCENE_PACKAGES is the folder that has the packages' node_modules,
// PHANTOM_SCENE_WIRE the file scene-wire.js of the build.
import {register} from 'node:module';
import {pathToFileURL} from 'node:url';

const packages = process.env.PHANTOM_SCENE_PACKAGES;
if (!packages)
  throw new Error(
    'PHANTOM_SCENE_PACKAGES is not set: the folder of the build in which npm installed what the scene is bundled with',
  );
if (!process.env.PHANTOM_SCENE_WIRE)
  throw new Error('PHANTOM_SCENE_WIRE is not set: the file scene-wire.js of the build');
const known = {
  three: `${packages}/node_modules/three/build/three.module.js`,
  'scene-wire': process.env.PHANTOM_SCENE_WIRE,
};
const urls = Object.fromEntries(Object.entries(known).map(([name, path]) => [name, pathToFileURL(path).href]));
register(
  'data:text/javascript,' +
    encodeURIComponent(`
  const urls = ${JSON.stringify(urls)};
  export const resolve = (name, context, next) => {
    const url = urls[name];
    return url ? { url, format: 'module', shortCircuit: true } : next(name, context);
  };`),
);

// A text is its key and what is filled in, as the page's language.js has them on `window`.
globalThis.window = {
  text: (key, values = {}) => [key, ...Object.values(values).filter(value => value !== '')].join(' '),
  said: words => words,
};

export const module = name => import(new URL(`../../scene/${name}`, import.meta.url));
export const three = await import('three');
