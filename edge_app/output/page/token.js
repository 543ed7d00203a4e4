// The form that asks for a token when the server says 401. The token is kept in this tab alone.
// askForToken() resolves when one was given; login is null while nobody is asked.

import {element, say} from './elements.js';

// One at a time, however many answers say 401.
export let login = null;
export function askForToken() {
  if (login) return login;
  const refused = sessionStorage.getItem('alidade-token') !== null;
  sessionStorage.removeItem('alidade-token');
  say('login-error', refused ? 'That token was refused.' : 'It is kept until this tab is closed.');
  element('login').hidden = false;
  element('main').hidden = true;
  element('token').value = '';
  element('token').focus();
  login = new Promise((resolve) => {
    element('login').onsubmit = (event) => {
      event.preventDefault();
      sessionStorage.setItem('alidade-token', element('token').value.trim());
      element('token').value = '';
      element('login').hidden = true;
      element('main').hidden = false;
      login = null;
      resolve();
    };
  });
  return login;
}
