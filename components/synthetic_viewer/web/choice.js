'use strict';
// A choice of one of several: a button that opens a list in the page. Not a <select>, whose open list takes the keys, Esc
// among them, before the page hears them, and covers what it likes. The button has the choice as its value and tells a new
// one by 'change'. Roles and keys: W3C ARIA, combobox that only selects.

const kChoices = new Map(); // button → { list, options }

function makeChoice(button) {
  const list = document.createElement('ul');
  Object.assign(list, {id: button.id + '-list', className: 'choice-list', hidden: true});
  list.setAttribute('role', 'listbox');
  button.setAttribute('role', 'combobox');
  button.setAttribute('aria-haspopup', 'listbox');
  button.setAttribute('aria-controls', list.id);
  button.setAttribute('aria-expanded', 'false');
  button.after(list);
  kChoices.set(button, {list, options: []});
  button.addEventListener('click', () => (list.hidden ? openChoice(button) : closeChoice(button)));
  button.addEventListener('blur', () => closeChoice(button));
  button.addEventListener('keydown', event => choiceKey(button, event));
  list.addEventListener('pointerdown', event => event.preventDefault()); // the focus stays with the button
  list.addEventListener('click', event => {
    const option = event.target.closest('[role=option]');
    if (option) takeChoice(button, option.dataset.value);
  });
}

// Sets what may be chosen: [value, text] each. The choice stays if it is among them; otherwise the first is chosen.
function offerChoice(button, options) {
  const choice = kChoices.get(button);
  if (JSON.stringify(options) !== JSON.stringify(choice.options)) {
    choice.options = options;
    choice.list.replaceChildren(
      ...options.map(([value, shown], i) => {
        const option = Object.assign(document.createElement('li'), {id: `${button.id}-${i}`, textContent: shown});
        option.setAttribute('role', 'option');
        option.dataset.value = value;
        return option;
      }),
    );
  }
  if (!options.some(([value]) => value === button.value)) button.value = options.length ? options[0][0] : '';
  showChoice(button);
}

function showChoice(button) {
  const {list, options} = kChoices.get(button);
  const chosen = options.findIndex(([value]) => value === button.value);
  put(button, chosen < 0 ? '–' : options[chosen][1]);
  [...list.children].forEach((option, i) => option.setAttribute('aria-selected', i === chosen));
  if (list.hidden) markChoice(button, chosen);
}

// Sets the choice as the viewer reports it, unless the operator is about to choose.
function setChoice(button, value) {
  if (!kChoices.get(button).list.hidden) return;
  button.value = value;
  showChoice(button);
}

function markChoice(button, index) {
  const {list} = kChoices.get(button);
  [...list.children].forEach((option, i) => option.classList.toggle('marked', i === index));
  const marked = list.children[index];
  button.setAttribute('aria-activedescendant', marked && !list.hidden ? marked.id : '');
  if (marked && !list.hidden) marked.scrollIntoView({block: 'nearest'});
}

function openChoice(button) {
  const {list, options} = kChoices.get(button);
  if (!options.length) return;
  list.hidden = false;
  button.setAttribute('aria-expanded', 'true');
  const {top, bottom, left, width} = button.getBoundingClientRect();
  const below = innerHeight - bottom,
    above = top;
  list.style.minWidth = width + 'px';
  list.style.maxHeight = Math.max(below, above) - 12 + 'px';
  list.style.left = Math.max(4, Math.min(left, document.documentElement.clientWidth - list.offsetWidth - 4)) + 'px';
  const down = below >= Math.min(list.scrollHeight + 8, above);
  Object.assign(
    list.style,
    down ? {top: bottom + 2 + 'px', bottom: ''} : {top: '', bottom: innerHeight - top + 2 + 'px'},
  );
  markChoice(
    button,
    options.findIndex(([value]) => value === button.value),
  );
}

function closeChoice(button) {
  const {list} = kChoices.get(button);
  list.hidden = true;
  button.setAttribute('aria-expanded', 'false');
  showChoice(button);
}

function takeChoice(button, value) {
  const other = value !== button.value;
  button.value = value;
  closeChoice(button);
  if (other) button.dispatchEvent(new Event('change'));
}

function choiceKey(button, event) {
  const {list, options} = kChoices.get(button);
  const marked = [...list.children].findIndex(option => option.classList.contains('marked'));
  const to = {
    ArrowDown: marked + 1,
    ArrowUp: marked - 1,
    Home: 0,
    End: options.length - 1,
    PageDown: marked + 5,
    PageUp: marked - 5,
  }[event.key];
  if (to !== undefined) {
    if (list.hidden) openChoice(button);
    else markChoice(button, Math.max(0, Math.min(options.length - 1, to)));
  } else if ((event.key === 'Enter' || event.key === ' ') && !list.hidden) {
    if (marked >= 0) takeChoice(button, options[marked][0]);
  } else if (event.key === 'Escape') {
    return closeChoice(button); // and stop.js stops
  } else {
    return;
  }
  event.preventDefault();
  event.stopPropagation(); // what moves the choice moves no camera
}

for (const button of document.querySelectorAll('.choice')) makeChoice(button);
function offerNamed() {
  for (const button of document.querySelectorAll('.choice[data-options]')) {
    const group = button.dataset.options + '.';
    offerChoice(
      button,
      Object.keys(kTexts.en)
        .filter(key => key.startsWith(group))
        .map(key => [key.slice(group.length), text(key)]),
    );
  }
}
addEventListener('language', offerNamed);
offerNamed();
addEventListener(
  'scroll',
  () => {
    for (const button of kChoices.keys()) closeChoice(button);
  },
  {passive: true},
);
