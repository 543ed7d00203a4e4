#include "edge_app/storage/sqlite.h"

#include <sqlite3.h>
#include <sys/stat.h>

#include <cstring>

namespace alidade {
namespace {

constexpr std::string_view kJournal = "-journal";

const sqlite3_vfs& system_files() {
  static const sqlite3_vfs files = *sqlite3_vfs_find(nullptr);
  return files;
}

bool is_journal(const char* path) {
  const std::string_view name = path != nullptr ? path : "";
  return name.size() >= kJournal.size() && name.substr(name.size() - kJournal.size()) == kJournal;
}

// SQLite looks for a journal whenever it begins to read. This also hides one that appears after
// open().
int is_accessible(sqlite3_vfs* files, const char* path, int how, int* result) {
  if (!is_journal(path)) return system_files().xAccess(files, path, how, result);
  *result = 0;
  return SQLITE_OK;
}

int open_file(sqlite3_vfs* files, const char* path, sqlite3_file* file, int flags, int* opened) {
  if ((flags & (SQLITE_OPEN_MAIN_JOURNAL | SQLITE_OPEN_SUPER_JOURNAL)) == 0)
    return system_files().xOpen(files, path, file, flags, opened);
  file->pMethods = nullptr;
  return SQLITE_CANTOPEN;
}

// The system's files without journals, registered under a name of its own.
const char* files_without_journals() {
  static constexpr const char* kName = "alidade";
  static sqlite3_vfs files = [] {
    sqlite3_vfs made = system_files();
    made.pNext = nullptr;
    made.zName = kName;
    made.xAccess = is_accessible;
    made.xOpen = open_file;
    return made;
  }();
  static const int registered = sqlite3_vfs_register(&files, 0);
  return registered == SQLITE_OK ? kName : nullptr;
}

}  // namespace

std::string foreign_file_beside(const std::string& database) {
  for (const char* rest : {kJournal.data(), "-wal", "-shm"}) {
    std::string path = database + rest;
    struct stat status = {};
    // Through a link, another file would be written.
    if (::lstat(path.c_str(), &status) == 0 && (rest == kJournal || !S_ISREG(status.st_mode)))
      return path;
  }
  return "";
}

std::string foreign_file_text(const std::string& file) {
  return file +
         " lies beside it, which this program did not put there and which could change or delete "
         "other files; remove it";
}

void SqliteDatabase::Close::operator()(sqlite3* handle) const { sqlite3_close_v2(handle); }

void SqliteStatement::Finalize::operator()(sqlite3_stmt* handle) const { sqlite3_finalize(handle); }

bool SqliteDatabase::open(const std::string& path, bool create) {
  forget_failure();
  sqlite3* handle = nullptr;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE |
                    (create ? SQLITE_OPEN_CREATE : 0);
  const char* const files = files_without_journals();
  const int code =
      files != nullptr ? sqlite3_open_v2(path.c_str(), &handle, flags, files) : SQLITE_ERROR;
  handle_.reset(handle);
  if (code != SQLITE_OK) {
    fail(code);
    handle_.reset();
    return false;
  }
  // For the file itself, if path is a link to it. Nothing has been read from it so far.
  foreign_file_ = foreign_file_beside(sqlite3_db_filename(handle, "main"));
  if (!foreign_file_.empty()) {
    fail(SQLITE_CANTOPEN);
    handle_.reset();
    return false;
  }
  constexpr int kPatience_ms = 2000;
  sqlite3_busy_timeout(handle, kPatience_ms);
  return true;
}

void SqliteDatabase::close() { handle_.reset(); }

void SqliteDatabase::fail(int code) {
  if (failure_ != 0) return;
  failure_ = code & 0xff;
  system_error_ = handle_ != nullptr ? sqlite3_system_errno(handle_.get()) : 0;
}

void SqliteDatabase::execute(const std::string& sql) {
  if (failed()) return;
  const int code = sqlite3_exec(handle_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(code);
}

std::int64_t SqliteDatabase::number_of(const std::string& sql) {
  SqliteStatement statement(this, sql.c_str());
  std::int64_t value = 0;
  return statement.step() && statement.get(0, &value) ? value : 0;
}

std::string SqliteDatabase::text_of(const std::string& sql) {
  SqliteStatement statement(this, sql.c_str());
  std::string text;
  return statement.step() && statement.get_text(0, &text) ? text : std::string();
}

void SqliteDatabase::limit_length(int bytes) {
  sqlite3_limit(handle_.get(), SQLITE_LIMIT_LENGTH, bytes);
}

std::string SqliteDatabase::failure_text() const {
  const auto because = [&](const char* what) {
    return std::string(what) +
           (system_error_ != 0 ? std::string(": ") + std::strerror(system_error_) : std::string());
  };
  if (!foreign_file_.empty()) return foreign_file_text(foreign_file_);
  switch (failure_) {
    case SQLITE_OK:
      return "";
    case SQLITE_NOTADB:
      return "not a database; expected one that this program made";
    case SQLITE_CORRUPT:
      return "damaged, or cut off";
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "in use by another process";
    case SQLITE_FULL:
      return "the disk is full";
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_AUTH:
      return "not writable";
    case SQLITE_CANTOPEN:
      return because("cannot be opened");
    case SQLITE_IOERR:
      return because("cannot be read or written");
    case SQLITE_TOOBIG:
      return "holds something larger than allowed";
    case SQLITE_CONSTRAINT:
      return "refused what refers to something that is not there, or is there twice";
    case SQLITE_NOMEM:
      return "needs more memory than there is";
    default:
      return sqlite3_errstr(failure_);
  }
}

SqliteStatement::SqliteStatement(SqliteDatabase* database, const char* sql) : database_(database) {
  if (database_->failed()) return;
  sqlite3_stmt* handle = nullptr;
  const int code = sqlite3_prepare_v2(database_->handle_.get(), sql, -1, &handle, nullptr);
  handle_.reset(handle);
  if (code != SQLITE_OK) database_->fail(code);
}

void SqliteStatement::bind(int at, double value) {
  if (database_->failed()) return;
  const int code = sqlite3_bind_double(handle_.get(), at, value);
  if (code != SQLITE_OK) database_->fail(code);
}

void SqliteStatement::bind(int at, std::int64_t value) {
  if (database_->failed()) return;
  const int code = sqlite3_bind_int64(handle_.get(), at, value);
  if (code != SQLITE_OK) database_->fail(code);
}

void SqliteStatement::bind_null(int at) {
  if (database_->failed()) return;
  const int code = sqlite3_bind_null(handle_.get(), at);
  if (code != SQLITE_OK) database_->fail(code);
}

void SqliteStatement::bind_blob(int at, const std::uint8_t* bytes, std::size_t size) {
  if (database_->failed()) return;
  // A null pointer would bind NULL.
  static constexpr std::uint8_t kNothing = 0;
  const int code =
      sqlite3_bind_blob64(handle_.get(), at, size > 0 ? bytes : &kNothing, size, SQLITE_TRANSIENT);
  if (code != SQLITE_OK) database_->fail(code);
}

void SqliteStatement::bind_text(int at, std::string_view text) {
  if (database_->failed()) return;
  const int code = sqlite3_bind_text64(handle_.get(), at, text.empty() ? "" : text.data(),
                                       text.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  if (code != SQLITE_OK) database_->fail(code);
}

bool SqliteStatement::step() {
  if (database_->failed()) return false;
  const int code = sqlite3_step(handle_.get());
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) database_->fail(code);
  return false;
}

void SqliteStatement::run() {
  while (step()) {
  }
  reset();
}

void SqliteStatement::reset() {
  if (handle_ != nullptr) sqlite3_reset(handle_.get());
}

bool SqliteStatement::get(int column, double* value) const {
  if (sqlite3_column_type(handle_.get(), column) != SQLITE_FLOAT) return false;
  *value = sqlite3_column_double(handle_.get(), column);
  return true;
}

bool SqliteStatement::get(int column, std::int64_t* value) const {
  if (sqlite3_column_type(handle_.get(), column) != SQLITE_INTEGER) return false;
  *value = sqlite3_column_int64(handle_.get(), column);
  return true;
}

bool SqliteStatement::get_blob(int column, std::vector<std::uint8_t>* bytes) const {
  if (sqlite3_column_type(handle_.get(), column) != SQLITE_BLOB) return false;
  const auto* first = static_cast<const std::uint8_t*>(sqlite3_column_blob(handle_.get(), column));
  const int size = sqlite3_column_bytes(handle_.get(), column);
  bytes->assign(first, first + size);
  return true;
}

bool SqliteStatement::get_text(int column, std::string* text) const {
  if (sqlite3_column_type(handle_.get(), column) != SQLITE_TEXT) return false;
  const auto* first = static_cast<const char*>(sqlite3_column_blob(handle_.get(), column));
  text->assign(first != nullptr ? first : "",
               static_cast<std::size_t>(sqlite3_column_bytes(handle_.get(), column)));
  return true;
}

bool SqliteStatement::is_null(int column) const {
  return sqlite3_column_type(handle_.get(), column) == SQLITE_NULL;
}

SqliteTransaction::SqliteTransaction(SqliteDatabase* database, bool for_writing)
    : database_(database) {
  database_->execute(for_writing ? "BEGIN IMMEDIATE" : "BEGIN");
}

SqliteTransaction::~SqliteTransaction() {
  sqlite3* handle = database_->handle_.get();
  if (handle != nullptr && sqlite3_get_autocommit(handle) == 0) {
    sqlite3_exec(handle, "ROLLBACK", nullptr, nullptr, nullptr);
  }
}

bool SqliteTransaction::commit() {
  database_->execute("COMMIT");
  return !database_->failed();
}

}  // namespace alidade
