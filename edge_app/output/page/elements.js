// The page's elements: found by id, and texts and tables that are filled.
// What already stands there is left alone, so that a selection or a screen reader is not disturbed.

export const element = (id) => document.getElementById(id);

export function say(id, text) {
  const shown = element(id);
  if (shown.textContent !== text) shown.textContent = text;
}

// A table's body: one row for each [name, value].
export function rows(body, entries) {
  const table = element(body);
  while (table.rows.length > entries.length) table.deleteRow(-1);
  while (table.rows.length < entries.length) {
    const row = table.insertRow();
    const head = document.createElement('th');
    head.scope = 'row';
    row.append(head, document.createElement('td'));
  }
  entries.forEach(([name, value], i) => {
    const [head, cell] = table.rows[i].children;
    if (head.textContent !== name) head.textContent = name;
    if (cell.textContent !== value) cell.textContent = value;
  });
}
