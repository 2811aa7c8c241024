"""File formats: conversion of poses, bodies and cameras to and from files."""
