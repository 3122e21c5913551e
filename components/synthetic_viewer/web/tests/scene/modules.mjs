// The modules of the scene, with the packages that it is bundled with: PHANTOM_SCENE_PACKAGES is the folder that has their node_modules.
import { register } from 'node:module';
import { pathToFileURL } from 'node:url';

const packages = process.env.PHANTOM_SCENE_PACKAGES;
if (!packages) throw new Error('PHANTOM_SCENE_PACKAGES is not set: the folder of the build in which npm installed what the scene is bundled with');
const { href } = pathToFileURL(`${packages}/node_modules/three/build/three.module.js`);
register('data:text/javascript,' + encodeURIComponent(`
  export const resolve = (name, context, next) => (name === 'three' ? { url: ${JSON.stringify(href)}, shortCircuit: true } : next(name, context));`));

// A text is its key and what is filled in, as the page's language.js has them on `window`.
globalThis.window = { text: (key, values = {}) => [key, ...Object.values(values).filter(value => value !== '')].join(' '), said: words => words };

export const module = name => import(new URL(`../../scene/${name}`, import.meta.url));
export const three = await import('three');
