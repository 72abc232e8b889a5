// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "fleet_schema.hpp"

#include <fmt/format.h>

namespace loopbit {
namespace {

/// A role is one of the whole server, so it may be there from another map.
constexpr const char* kRoles = R"(
DO $$
BEGIN
  IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = 'loopbit_reader') THEN
    CREATE ROLE loopbit_reader NOLOGIN;
  END IF;
  IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = 'loopbit_writer') THEN
    CREATE ROLE loopbit_writer NOLOGIN;
    GRANT loopbit_reader TO loopbit_writer;
  END IF;
END
$$)";

/// docs/format.md explains the columns that a map file does not have. The limits are those that the
/// readers of a map have, too.
constexpr const char* kTables = R"(
CREATE SCHEMA loopbit;
CREATE TABLE migration (version bigint PRIMARY KEY, applied timestamptz NOT NULL DEFAULT now());
CREATE SEQUENCE session_number AS integer;
CREATE SEQUENCE batch_number;
CREATE TABLE batch (batch bigint PRIMARY KEY, epoch bigint NOT NULL UNIQUE);
CREATE TABLE session (
  session bigint PRIMARY KEY CHECK (session BETWEEN 1 AND 2147483647),
  uid text NOT NULL UNIQUE,
  name bytea NOT NULL,
  started text NOT NULL,
  loopbit text NOT NULL,
  options text NOT NULL,
  frames bigint NOT NULL CHECK (frames BETWEEN 0 AND 2147483648),
  checksum bigint NOT NULL,
  owner text NOT NULL DEFAULT current_user);
CREATE TABLE place (
  place bigint PRIMARY KEY CHECK (place = (session << 32) + frame),
  session bigint NOT NULL REFERENCES session,
  frame bigint NOT NULL CHECK (frame BETWEEN 0 AND 2147483647),
  timestamp double precision CHECK (abs(timestamp) < 'Infinity'),
  content bytea NOT NULL CHECK (octet_length(content) = 512),
  checksum bigint NOT NULL,
  batch bigint NOT NULL DEFAULT currval('batch_number')
    REFERENCES batch DEFERRABLE INITIALLY DEFERRED);
CREATE TABLE features (
  place bigint PRIMARY KEY REFERENCES place ON DELETE CASCADE,
  features bytea NOT NULL CHECK (octet_length(features) BETWEEN 16 AND 800016),
  checksum bigint NOT NULL);
CREATE TABLE image (
  place bigint PRIMARY KEY REFERENCES place ON DELETE CASCADE,
  image bytea NOT NULL CHECK (octet_length(image) <= 16777216),
  checksum bigint NOT NULL);
CREATE TABLE loop (
  loop bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  session bigint NOT NULL REFERENCES session,
  frame bigint NOT NULL,
  match_session bigint NOT NULL,
  match_frame bigint NOT NULL,
  score double precision NOT NULL CHECK (abs(score) < 'Infinity'),
  similarity double precision NOT NULL CHECK (abs(similarity) < 'Infinity'),
  matches bigint NOT NULL,
  inliers bigint NOT NULL,
  checksum bigint NOT NULL,
  batch bigint NOT NULL DEFAULT currval('batch_number')
    REFERENCES batch DEFERRABLE INITIALLY DEFERRED);
CREATE TABLE rejected (
  LIKE loop INCLUDING CONSTRAINTS,
  rejected bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  FOREIGN KEY (session) REFERENCES session);
ALTER TABLE rejected DROP COLUMN loop;
ALTER TABLE rejected ALTER COLUMN batch SET DEFAULT currval('batch_number');
CREATE TABLE odometry (
  odometry bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  session bigint NOT NULL REFERENCES session,
  frame bigint NOT NULL,
  timestamp double precision CHECK (abs(timestamp) < 'Infinity'),
  pose bytea NOT NULL CHECK (octet_length(pose) = 264),
  checksum bigint NOT NULL);
CREATE TABLE relative_pose (
  relative_pose bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  session bigint NOT NULL REFERENCES session,
  frame bigint NOT NULL,
  match_session bigint NOT NULL,
  match_frame bigint NOT NULL,
  known text NOT NULL,
  pose bytea NOT NULL CHECK (octet_length(pose) = 264),
  checksum bigint NOT NULL);
CREATE TABLE linked (session bigint PRIMARY KEY REFERENCES session, checksum bigint NOT NULL);
CREATE TABLE moved (uid text PRIMARY KEY, session bigint NOT NULL);
-- Neither can be compressed any more.
ALTER TABLE features ALTER COLUMN features SET STORAGE EXTERNAL;
ALTER TABLE image ALTER COLUMN image SET STORAGE EXTERNAL;
CREATE INDEX ON place (session);
CREATE INDEX ON place (batch);
CREATE INDEX ON loop (session, frame);
CREATE INDEX ON loop (batch);
CREATE INDEX ON rejected (batch);
CREATE INDEX ON rejected (session, frame))";

/// The lock makes epochs follow each other as commits do. Sessions that began after one that grows
/// were not compared with all of it. What a robot still has of a session that was moved is refused:
/// it would be a second one.
constexpr const char* kFunctions = R"(
CREATE FUNCTION end_batch() RETURNS bigint LANGUAGE plpgsql SECURITY DEFINER
SET search_path = loopbit, pg_temp AS $$
DECLARE
  now_epoch bigint;
BEGIN
  PERFORM pg_advisory_xact_lock(1819242352, 0);
  INSERT INTO batch SELECT currval('batch_number'), coalesce(max(epoch), 0) + 1 FROM batch
    RETURNING epoch INTO now_epoch;
  DELETE FROM linked WHERE
    session > (SELECT min(place.session) FROM place WHERE batch = currval('batch_number')) AND
    session NOT IN (SELECT place.session FROM place WHERE batch = currval('batch_number'));
  PERFORM pg_notify('loopbit_batch', '');
  RETURN now_epoch;
END
$$;
REVOKE ALL ON FUNCTION end_batch() FROM PUBLIC;
CREATE FUNCTION is_own(number bigint) RETURNS boolean LANGUAGE sql STABLE
SET search_path = loopbit, pg_temp AS $$
  SELECT EXISTS (SELECT FROM session WHERE session.session = number AND owner = current_user)
$$;
CREATE FUNCTION refuse_moved() RETURNS trigger LANGUAGE plpgsql
SET search_path = loopbit, pg_temp AS $$
DECLARE
  number bigint;
BEGIN
  SELECT moved.session INTO number FROM moved WHERE uid = NEW.uid;
  IF FOUND THEN
    RAISE 'session % was moved to another server; add its frames to the map there', number;
  END IF;
  RETURN NEW;
END
$$;
CREATE TRIGGER refuse_moved BEFORE INSERT ON session FOR EACH ROW EXECUTE FUNCTION refuse_moved())";

/// A writer adds sessions, and changes only those that it added.
constexpr const char* kRights = R"(
GRANT USAGE ON SCHEMA loopbit TO loopbit_reader;
GRANT SELECT ON ALL TABLES IN SCHEMA loopbit TO loopbit_reader;
GRANT USAGE ON SEQUENCE session_number, batch_number TO loopbit_writer;
GRANT EXECUTE ON FUNCTION end_batch() TO loopbit_writer;
GRANT INSERT (session, uid, name, started, loopbit, options, frames, checksum),
  UPDATE (frames, checksum) ON session TO loopbit_writer;
GRANT INSERT (place, session, frame, timestamp, content, checksum), DELETE ON place TO loopbit_writer;
GRANT INSERT, DELETE ON features, image TO loopbit_writer;
GRANT DELETE ON loop TO loopbit_writer;
GRANT INSERT (session, frame, match_session, match_frame, score, similarity, matches, inliers, checksum)
  ON loop, rejected TO loopbit_writer;
GRANT INSERT ON odometry, relative_pose TO loopbit_writer;
GRANT INSERT, UPDATE (checksum) ON linked TO loopbit_writer;
ALTER TABLE session ENABLE ROW LEVEL SECURITY;
CREATE POLICY readable ON session FOR SELECT TO loopbit_reader USING (true);
CREATE POLICY added ON session FOR INSERT TO loopbit_writer WITH CHECK (owner = current_user);
CREATE POLICY changed ON session FOR UPDATE TO loopbit_writer USING (owner = current_user);
DO $$
DECLARE
  part record;
BEGIN
  FOR part IN VALUES ('place', 'session'), ('features', 'place >> 32'), ('image', 'place >> 32'),
    ('loop', 'session'), ('rejected', 'session'), ('linked', 'session'), ('odometry', 'session'),
    ('relative_pose', 'session') LOOP
    EXECUTE format('ALTER TABLE %I ENABLE ROW LEVEL SECURITY', part.column1);
    EXECUTE format('CREATE POLICY readable ON %I FOR SELECT TO loopbit_reader USING (true)',
                   part.column1);
    EXECUTE format('CREATE POLICY own ON %I TO loopbit_writer USING (is_own(%s))', part.column1,
                   part.column2);
  END LOOP;
END
$$)";

/// If the server has the extension and the user may load it, similar places are found on the
/// server.
constexpr const char* kSearch = R"(
DO $$
BEGIN
  IF EXISTS (SELECT FROM pg_roles WHERE rolname = current_user AND rolsuper)
    AND EXISTS (SELECT FROM pg_available_extensions WHERE name = 'loopbit' AND installed_version IS NULL) THEN
    CREATE EXTENSION loopbit SCHEMA loopbit;
    CREATE INDEX place_content ON place USING loopbit ((content::binary_content));
  END IF;
END
$$)";

}  // namespace

void create_tables(const Connection& connection, int first_session) {
  connection.execute(kRoles);
  for (const char* part : {kTables, kFunctions, kRights, kSearch}) connection.execute(part);
  connection.run("SELECT setval('session_number', $1, false)", {parameter(first_session)});
  connection.run("INSERT INTO migration (version) VALUES ($1)", {parameter(kFleetVersion)});
}

bool has_tables(const Connection& connection) {
  return connection.integer("SELECT count(*) FROM pg_namespace WHERE nspname = 'loopbit'") > 0;
}

void check_version(const Connection& connection) {
  if (!has_tables(connection)) {
    connection.refuse(fmt::format("is a database without a map; 'loopbit map create {}' makes one",
                                  connection.shown()));
  }
  const std::int64_t version = connection.integer("SELECT max(version) FROM loopbit.migration");
  if (version == kFleetVersion) return;
  connection.refuse(fmt::format(
      "has a map of version {}, but this loopbit knows version {}; {}", version, kFleetVersion,
      version > kFleetVersion ? "use a newer loopbit"
                              : "save it with the loopbit that made it, by 'loopbit map merge "
                                "COPY.db ADDRESS', and merge the copy into a new database"));
}

}  // namespace loopbit
