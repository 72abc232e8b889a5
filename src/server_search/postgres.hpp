// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

// Before all other headers: PostgreSQL's are C, and define macros such as printf.
#if defined(__clang__)
#pragma clang diagnostic ignored "-Wgnu-statement-expression"  // in its macros
#endif
extern "C" {
// clang-format off
#include <postgres.h>
// clang-format on
#include <access/amapi.h>
#include <access/amvalidate.h>
#include <access/genam.h>
#include <access/generic_xlog.h>
#include <access/reloptions.h>
#include <access/relscan.h>
#include <access/tableam.h>
#include <access/xloginsert.h>
#include <catalog/index.h>
#include <catalog/pg_amop.h>
#include <catalog/pg_opclass.h>
#include <catalog/pg_type.h>
#include <commands/vacuum.h>
#include <fmgr.h>
#include <libpq/pqformat.h>
#include <miscadmin.h>
#include <optimizer/optimizer.h>
#include <pgstat.h>
#include <storage/bufmgr.h>
#include <storage/lmgr.h>
#include <storage/smgr.h>
#include <utils/builtins.h>
#include <utils/guc.h>
#include <utils/memutils.h>
#include <utils/rel.h>
#include <utils/selfuncs.h>
#include <utils/syscache.h>
#include <windowapi.h>
}
