'use strict';
// The session: which role this browser has, and the form by which it gets one. The emergency stop needs none.

const kRoles = ['watch', 'operate', 'configure'];
let session = {secrets: false, role: null}; // newest answer of GET /session

const loggedOut = () => session.secrets && session.role === null;
// Returns whether this browser may do what needs a role.
const may = role => !session.secrets || kRoles.indexOf(session.role) >= kRoles.indexOf(role);

function showSession() {
  byId('login').hidden = !loggedOut();
  byId('logout').hidden = !session.secrets || loggedOut();
  put(
    'role',
    !session.secrets
      ? text('session.no_secrets')
      : loggedOut()
        ? ''
        : text('session.role', {role: text('role.' + session.role)}),
  );
}

async function askSession() {
  try {
    const response = await fetch('session', {signal: within(1000), cache: 'no-store'});
    if (response.ok) session = await response.json();
  } catch (problem) {
    /* showBanner() reports it */
  }
  showSession();
}

// Posts to a path that changes the session. Returns why that was refused; empty if it was not.
async function changeSession(path, body) {
  try {
    const response = await fetch(path, {
      method: 'POST',
      headers: {'Content-Type': 'application/json'},
      body: JSON.stringify(body),
    });
    const answer = await response.json();
    if (!answer.ok) return answer.message;
    session = answer;
  } catch (problem) {
    return text('session.no_answer', {problem: problem.message});
  }
  showSession();
  return '';
}

byId('login').addEventListener('submit', async event => {
  event.preventDefault();
  const problem = await changeSession('login', {secret: byId('secret').value.trim()});
  put('login-answer', problem && text('session.refused', {message: problem}));
  if (problem) return;
  byId('secret').value = '';
  stream.hurry();
});
byId('logout').addEventListener('click', async () => {
  if (!(await changeSession('logout', {}))) location.reload();
});
addEventListener('language', showSession);
askSession();
setInterval(() => {
  if (!document.hidden) askSession();
}, 30000);
