// Requests to /api/v1, with this tab's token. No cookies, no redirects, nothing kept.
// A refused request throws ApiError: its status, and the line that the server gave as the reason.

export class ApiError extends Error {
  constructor(status, line) {
    super(line);
    this.status = status;
  }
}

export async function api(path, options = {}) {
  const headers = new Headers(options.headers);
  const token = sessionStorage.getItem('alidade-token');
  if (token) headers.set('Authorization', `Bearer ${token}`);
  const response = await fetch(path, {...options, headers, cache: 'no-store', credentials: 'omit', redirect: 'error'});
  if (response.ok) return response;
  const answer = await response.json().catch(() => ({}));
  throw new ApiError(response.status, String(answer.error ?? response.statusText));
}

export const soon = () => ({signal: AbortSignal.timeout(5000)});
export const getJson = async (path) => (await api(path, soon())).json();
export const postJson = async (path, body) => (await api(path, {
  ...soon(), method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify(body),
})).json();
