// What the drawn scene says, in the page's language.

const kWords = {
  en: {
    'scene.here': 'Drawn in this browser', 'scene.server': 'Pictures from the server', 'scene.choose_server': 'Server pictures',
    'scene.choose_title': 'Shows the pictures that the viewer draws, in the place of those that this browser draws',
    'scene.why': 'Pictures from the server: {reason}', 'scene.still': 'THE PICTURE STANDS STILL: nothing comes from the viewer',
    'scene.age': 'pose {age_ms} ms old when drawn', 'scene.no_pose': 'no pose yet', 'scene.no_stream': 'the scene does not come', 'scene.no_webgl': 'this browser has no WebGL 2',
    'scene.lost': 'the graphics card was lost', 'scene.headset': 'Enter headset', 'scene.headset_end': 'Leave headset',
    'scene.headset_title': 'The same scene in stereo, in a headset (WebXR)', 'scene.in_headset': 'Shown in the headset',
    'scene.closeness': 'Closeness', 'scene.speed': 'Speed', 'scene.state': 'Slave', 'scene.unknown': 'unknown',
  },
  de: {
    'scene.here': 'In diesem Browser gezeichnet', 'scene.server': 'Bilder vom Server', 'scene.choose_server': 'Serverbilder',
    'scene.choose_title': 'Zeigt die Bilder, die der Viewer zeichnet, anstelle derer, die dieser Browser zeichnet',
    'scene.why': 'Bilder vom Server: {reason}', 'scene.still': 'DAS BILD STEHT: vom Viewer kommt nichts',
    'scene.age': 'Pose beim Zeichnen {age_ms} ms alt', 'scene.no_pose': 'noch keine Pose', 'scene.no_stream': 'die Szene kommt nicht', 'scene.no_webgl': 'dieser Browser hat kein WebGL 2',
    'scene.lost': 'die Grafikkarte ging verloren', 'scene.headset': 'Headset aufsetzen', 'scene.headset_end': 'Headset verlassen',
    'scene.headset_title': 'Dieselbe Szene in Stereo, im Headset (WebXR)', 'scene.in_headset': 'Im Headset gezeigt',
    'scene.closeness': 'Nähe', 'scene.speed': 'Tempo', 'scene.state': 'Slave', 'scene.unknown': 'unbekannt',
  },
};

export function say(key, values = {}) {
  const words = kWords[document.documentElement.lang.slice(0, 2)] ?? kWords.en;
  return words[key].replace(/\{(\w+)\}/g, (whole, name) => String(values[name]));
}
