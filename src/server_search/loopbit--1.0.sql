-- SPDX-FileCopyrightText: 2026 The loopbit authors
-- SPDX-License-Identifier: MIT
\echo Use "CREATE EXTENSION loopbit" to load this file. \quit

-- 64 rows of 64 pixels, 8 bytes each; docs/fleet.md
CREATE TYPE binary_content;
CREATE FUNCTION binary_content_in(cstring) RETURNS binary_content
  AS 'MODULE_PATHNAME', 'loopbit_content_in' LANGUAGE C IMMUTABLE STRICT PARALLEL SAFE;
CREATE FUNCTION binary_content_out(binary_content) RETURNS cstring
  AS 'MODULE_PATHNAME', 'loopbit_content_out' LANGUAGE C IMMUTABLE STRICT PARALLEL SAFE;
CREATE FUNCTION binary_content_recv(internal) RETURNS binary_content
  AS 'MODULE_PATHNAME', 'loopbit_content_recv' LANGUAGE C IMMUTABLE STRICT PARALLEL SAFE;
CREATE FUNCTION binary_content_send(binary_content) RETURNS bytea
  AS 'MODULE_PATHNAME', 'loopbit_content_to_bytes' LANGUAGE C IMMUTABLE STRICT PARALLEL SAFE;
CREATE TYPE binary_content (
  INPUT = binary_content_in, OUTPUT = binary_content_out,
  RECEIVE = binary_content_recv, SEND = binary_content_send,
  INTERNALLENGTH = 512, ALIGNMENT = double, STORAGE = plain);

CREATE FUNCTION binary_content(bytea) RETURNS binary_content
  AS 'MODULE_PATHNAME', 'loopbit_content_from_bytes' LANGUAGE C IMMUTABLE STRICT PARALLEL SAFE;
CREATE FUNCTION bytea(binary_content) RETURNS bytea
  AS 'MODULE_PATHNAME', 'loopbit_content_to_bytes' LANGUAGE C IMMUTABLE STRICT PARALLEL SAFE;
CREATE CAST (bytea AS binary_content) WITH FUNCTION binary_content(bytea) AS ASSIGNMENT;
CREATE CAST (binary_content AS bytea) WITH FUNCTION bytea(binary_content) AS ASSIGNMENT;

-- The similarity xi of docs/method.md, the most over all shifts of a that are tolerated
CREATE FUNCTION similarity(a binary_content, b binary_content, shift_tolerance_columns integer DEFAULT 0)
  RETURNS double precision
  AS 'MODULE_PATHNAME', 'loopbit_similarity' LANGUAGE C IMMUTABLE STRICT PARALLEL SAFE COST 10;

-- 1 - similarity(query, content, loopbit.shift_tolerance_columns)
CREATE FUNCTION distance(content binary_content, query binary_content) RETURNS double precision
  AS 'MODULE_PATHNAME', 'loopbit_distance' LANGUAGE C STABLE STRICT PARALLEL SAFE COST 10;
CREATE OPERATOR <~> (LEFTARG = binary_content, RIGHTARG = binary_content, FUNCTION = distance);

-- What a robot needs of a map beside similar places; see src/map_file/searched_places.cpp
CREATE FUNCTION place_checksum(session bigint, frame bigint, "timestamp" double precision, content binary_content)
  RETURNS bigint
  AS 'MODULE_PATHNAME', 'loopbit_place_checksum' LANGUAGE C IMMUTABLE PARALLEL SAFE COST 10;
CREATE FUNCTION changes_view(content binary_content, unmoved double precision, is_whole boolean) RETURNS boolean
  AS 'MODULE_PATHNAME', 'loopbit_changes_view' LANGUAGE C IMMUTABLE WINDOW COST 10;

CREATE FUNCTION loopbit_index_handler(internal) RETURNS index_am_handler
  AS 'MODULE_PATHNAME' LANGUAGE C;
CREATE ACCESS METHOD loopbit TYPE INDEX HANDLER loopbit_index_handler;
CREATE OPERATOR CLASS binary_content_ops DEFAULT FOR TYPE binary_content USING loopbit AS
  OPERATOR 1 <~> FOR ORDER BY pg_catalog.float_ops;
